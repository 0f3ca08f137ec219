// Vectors and the Stokes frames of the Monte Carlo.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace twilight {

struct Vec3 {
  double x, y, z;
  Vec3 operator+(const Vec3& b) const { return {x + b.x, y + b.y, z + b.z}; }
  Vec3 operator-(const Vec3& b) const { return {x - b.x, y - b.y, z - b.z}; }
  Vec3 operator*(double f) const { return {x * f, y * f, z * f}; }
};
inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline Vec3 unit(const Vec3& a) { return a * (1 / norm(a)); }
/// Some unit vector across a.
inline Vec3 any_normal(const Vec3& a) {
  return unit(std::abs(a.x) < 0.6 ? cross(a, {1, 0, 0}) : cross(a, {0, 1, 0}));
}

/// Where light travelling against `direction` scatters into light travelling against another: the
/// rotation from the scattering plane's basis into the frame {axis, direction x axis} of the
/// scattered light, (Q, U) = (c Q' - s U', s Q' + c U') with c, s of twice the angle, and the axis
/// of the incoming light's own frame, which lies in the scattering plane.
struct ScatteringFrame {
  double cos2 = 1, sin2 = 0;
  Vec3 axis_in{1, 0, 0};
};

/// direction: looking along the scattered light's ray, away from the observer; axis: its Stokes
/// axis (Q > 0 along it); incoming: looking along the incoming light's ray. All units.
inline ScatteringFrame scattering_frame(const Vec3& direction, const Vec3& axis,
                                        const Vec3& incoming) {
  ScatteringFrame f;
  Vec3 across = cross(direction, incoming);
  const double size = norm(across);
  // Forwards and backwards every plane is the scattering plane.
  across = size > 1e-9 ? across * (1 / size) : cross(direction, axis);
  const Vec3 along = cross(across, direction);
  const double c = dot(along, axis), s = dot(along, cross(direction, axis));
  f.cos2 = c * c - s * s;
  f.sin2 = 2 * c * s;
  f.axis_in = cross(across, incoming);
  return f;
}

/// Per wavelength the 3 x 4 matrix that takes Stokes parameters of light arriving at the path's
/// end to (I, Q, U) at the observer: rows I, Q, U; columns I, Q, U, V; [row][column][wavelength].
class StokesWeights {
 public:
  explicit StokesWeights(std::size_t wavelengths)
      : wavelengths_(wavelengths), value_(12 * wavelengths) {}
  double* at(std::size_t row, std::size_t column) {
    return &value_[(row * 4 + column) * wavelengths_];
  }
  const double* at(std::size_t row, std::size_t column) const {
    return &value_[(row * 4 + column) * wavelengths_];
  }

 private:
  std::size_t wavelengths_;
  std::vector<double> value_;
};

}  // namespace twilight
