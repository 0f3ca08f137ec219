// Options of solver.method = "nishita".
#pragma once

namespace twilight {

/// How finely single scattering is summed.
struct NishitaOptions {
  /// Steps that converge (1e-4 of each radiance) in place of the samples below.
  bool converged = false;
  int view_samples = 16;  ///< even segments of the view ray, 1..100000 (the lesson's 16)
  int light_samples = 8;  ///< and of each ray to the Sun, 1..100000 (the lesson's 8)
};

}  // namespace twilight
