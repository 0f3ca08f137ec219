#include "aerosols/libradtran_optics.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "aerosols/component_phase.h"
#include "aerosols/imported_phase.h"
#include "aerosols/optics_units.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr std::size_t kElements = 4;
constexpr double kShapeWavelengthNm = 550.0;
constexpr double kWaterGPerCm3 = 1.0;

std::string shown(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

class LibradtranReader {
 public:
  explicit LibradtranReader(const NetcdfReader& file) : file_(file) {}

  ParticleOptics read() {
    read_axes();
    read_coefficients();
    const bool angles = file_.has_variable("phase") && file_.has_variable("theta");
    if (angles || file_.has_variable("pmom")) read_phases(angles);
    read_asymmetry();
    if (optics_.per == OpticsPer::kExtinctionAt550nm) make_shape();
    optics_.name = std::filesystem::path(file_.name()).stem().string();
    restore_order();
    require_particle_optics(optics_, file_.name());
    return std::move(optics_);
  }

 private:
  template <class Unit>
  auto unit_of(std::string_view variable, Unit known, std::string_view assumed,
               std::string_view example) const {
    const std::string unit = file_.text_attribute(variable, "units").value_or(std::string(assumed));
    const auto found = known(unit);
    if (!found) {
      file_.refuse_variable(variable, "has the unknown unit '" + unit + "': must be as '" +
                                          std::string(example) + "'");
    }
    return *found;
  }

  void read_axes() {
    const double nm = unit_of("wavelen", nm_in, "um", "micrometer");
    optics_.wavelength_nm = file_.numbers("wavelen", std::vector<std::string>{"nlam"});
    for (double& w : optics_.wavelength_nm) w *= nm;
    if (file_.has_variable("hum")) {
      state_ = "nhum";
      // libRadtran writes "per cent", which percent_in() reads without its blank.
      const double percent = unit_of("hum", percent_in, "percent", "percent");
      optics_.relative_humidity_percent = file_.numbers("hum", std::vector<std::string>{"nhum"});
      for (double& h : optics_.relative_humidity_percent) h *= percent;
    } else {
      state_ = "nreff";
      if (!file_.has_variable("reff")) file_.refuse("has neither variable 'hum' nor 'reff'");
      if (file_.size("nreff") != 1) {
        file_.refuse_variable("reff", "has " + std::to_string(file_.size("nreff")) +
                                          " sizes: must have one, the particles of an aerosol");
      }
      optics_.relative_humidity_percent = {0.0};
    }
    check_axis("wavelen", optics_.wavelength_nm);
    check_axis("hum", optics_.relative_humidity_percent);
    W_ = optics_.wavelength_nm.size();
    H_ = optics_.relative_humidity_percent.size();
  }

  // Falling wavelengths are turned at the end.
  void check_axis(std::string_view variable, const std::vector<double>& values) const {
    if (values.empty()) file_.refuse_variable(variable, "is empty");
    const bool falls = variable == "wavelen" && values.front() > values.back();
    for (std::size_t i = 1; i < values.size(); ++i) {
      if (falls ? !(values[i] < values[i - 1]) : !(values[i] > values[i - 1])) {
        file_.refuse_variable(variable, "is not strictly increasing at index " + std::to_string(i) +
                                            ": " + shown(values[i]));
      }
    }
    if (variable == "wavelen" && !(std::min(values.front(), values.back()) > 0.0)) {
      file_.refuse_variable(variable, "must be above 0");
    }
    if (variable == "hum" && !(values.front() >= 0.0 && values.back() <= 99.0)) {
      file_.refuse_variable(variable, "reaches from " + shown(values.front()) + " to " +
                                          shown(values.back()) + " %: must be 0..99");
    }
  }

  std::vector<double> table(std::string_view variable) const {
    return file_.numbers(variable, std::vector<std::string>{"nlam", state_});
  }

  std::string at(std::size_t w, std::size_t h) const {
    return " at " + shown(optics_.wavelength_nm[w]) + " nm, " +
           shown(optics_.relative_humidity_percent[h]) + " % humidity";
  }

  void read_coefficients() {
    const CoefficientUnit unit = unit_of("ext", coefficient_unit, "km^-1/(g/m^3)", "km^-1/(g/m^3)");
    optics_.per = unit.per;
    const std::vector<double> ext = table("ext"), ssa = table("ssa");
    const std::vector<double> growth = optics_.per == OpticsPer::kMicrogramPerM3 && H_ > 1
                                           ? mass_growth()
                                           : std::vector<double>(H_, 1.0);
    optics_.optics.resize(H_ * W_);
    for (std::size_t h = 0; h < H_; ++h) {
      for (std::size_t w = 0; w < W_; ++w) {
        const double e = ext[w * H_ + h], albedo = ssa[w * H_ + h];
        if (!(e > 0.0)) {
          file_.refuse_variable("ext", "is " + shown(e) + at(w, h) + ": must be above 0");
        }
        // Mie codes in single precision end a hair beyond 1.
        if (!(albedo >= 0.0 && albedo <= 1.0 + 1e-5)) {
          file_.refuse_variable("ssa", "is " + shown(albedo) + at(w, h) + ": must be 0..1");
        }
        const double extinction = e * unit.per_km * growth[h];
        const double bounded = std::min(albedo, 1.0);
        optics_.optics[optics_.index(h, w)] = {.scattering_per_km = extinction * bounded,
                                               .absorption_per_km = extinction * (1.0 - bounded),
                                               .asymmetry = 0.0};
      }
    }
  }

  // Mass of the particle with its water over that at the first humidity.
  std::vector<double> mass_growth() const {
    if (!file_.has_variable("rho")) {
      file_.refuse_variable("rho",
                            "is missing: extinction per mass of wet particles at several "
                            "humidities cannot be referred to dry matter");
    }
    const std::string unit = file_.text_attribute("rho", "units").value_or("g/cm^3");
    if (unit != "g/cm^3" && unit != "g cm-3" && unit != "g/cm3") {
      file_.refuse_variable("rho", "has the unknown unit '" + unit + "': must be as 'g/cm^3'");
    }
    const std::vector<double> all = file_.numbers("rho");
    if (all.size() < H_) file_.refuse_variable("rho", "has too few values");
    std::vector<double> growth;
    for (std::size_t h = 0; h < H_; ++h) {
      const double dry = all[0], wet = all[h];
      const bool grows = wet < dry;
      if (h > 0 && wet == dry) {  // takes up no water
        growth.push_back(1.0);
        continue;
      }
      if (!(dry > kWaterGPerCm3 && wet > kWaterGPerCm3 && (h == 0 || grows))) {
        file_.refuse_variable("rho", "is " + shown(wet) + " at " +
                                         shown(optics_.relative_humidity_percent[h]) +
                                         " % humidity: must be between water's 1 g/cm^3 and the "
                                         "first humidity's " +
                                         shown(dry));
      }
      growth.push_back((dry - kWaterGPerCm3) * wet / ((wet - kWaterGPerCm3) * dry));
    }
    return growth;
  }

  void read_phases(bool angles) {
    const std::string along = angles ? "nthetamax" : "nmommax";
    const std::vector<std::string> counted = {"nlam", state_, "nphamat"};
    std::vector<std::string> whole = counted;
    whole.push_back(along);
    const std::string_view count_name = angles ? "ntheta" : "nmom";
    const std::string_view value_name = angles ? "phase" : "pmom";
    require_dimensions(count_name, counted);
    require_dimensions(value_name, whole);
    const std::size_t P = file_.size("nphamat"), length = file_.size(along);
    if (P != 1 && P != 4 && P != 6) {
      file_.refuse_variable(value_name,
                            "has " + std::to_string(P) + " matrix elements: must have 1, 4 or 6");
    }
    const std::vector<double> counts = file_.numbers(count_name);
    const std::vector<double> values = file_.numbers(value_name, false);
    std::vector<double> theta;
    double degree = 1.0;
    if (angles) {
      require_dimensions("theta", whole);
      degree = unit_of("theta", degrees_in, "degrees", "degrees");
      theta = file_.numbers("theta", false);
    }
    const std::size_t elements = std::min(P, kElements);
    optics_.phase.resize(H_ * W_);
    for (std::size_t w = 0; w < W_; ++w) {
      for (std::size_t h = 0; h < H_; ++h) {
        std::array<std::vector<double>, kElements> value, angle;
        for (std::size_t e = 0; e < elements; ++e) {
          const std::size_t i = (w * H_ + h) * P + e;
          if (!(counts[i] >= 1.0 && counts[i] <= static_cast<double>(length))) {
            file_.refuse_variable(count_name, "is " + shown(counts[i]) + at(w, h) +
                                                  ": must be 1.." + std::to_string(length) +
                                                  ", the length of " + along);
          }
          const auto n = static_cast<std::ptrdiff_t>(counts[i]);
          const auto part = [&](const std::vector<double>& from) {
            const auto start = from.begin() + static_cast<std::ptrdiff_t>(i * length);
            return std::vector<double>(start, start + n);
          };
          value[e] = part(values);
          // libRadtran's P34 has the other sign (MOPSMAP writes -b2 for it).
          if (e == 3) std::ranges::transform(value[e], value[e].begin(), std::negate<>());
          if (angles) angle[e] = part(theta);
        }
        const RefuseElement refuse = [&](std::string_view element, const std::string& what) {
          file_.refuse_variable(element == "angle" ? "theta" : value_name,
                                "(" + std::string(element) + ")" + at(w, h) + ": " + what);
        };
        PhaseMatrix& phase = optics_.phase[optics_.index(h, w)];
        phase = angles ? phase_of_angles(std::move(value), angle, elements, degree, refuse)
                       : phase_of_moments(value, refuse);
      }
    }
  }

  void require_dimensions(std::string_view variable, const std::vector<std::string>& wanted) const {
    const std::vector<std::string> held = file_.dimensions(variable);
    if (held == wanted) return;
    std::string text;
    for (const std::string& d : wanted) text += (text.empty() ? "" : ", ") + d;
    file_.refuse_variable(variable, "must have the dimensions (" + text + ")");
  }

  // Elements on the angles of the first, from the forward direction on.
  static PhaseMatrix phase_of_angles(std::array<std::vector<double>, kElements> value,
                                     std::array<std::vector<double>, kElements> angle,
                                     std::size_t elements, double degree,
                                     const RefuseElement& refuse) {
    for (std::size_t e = 0; e < elements; ++e) {
      if (angle[e].front() > angle[e].back()) {
        std::ranges::reverse(angle[e]);
        std::ranges::reverse(value[e]);
      }
      for (double& a : angle[e]) a *= degree * kRadPerDeg;
    }
    PhaseMatrix phase;
    phase.angle_rad = angle[0];
    std::vector<double>* const into[] = {&phase.p11, &phase.p12, &phase.p33, &phase.p34};
    for (std::size_t e = 0; e < kElements; ++e) {
      if (e >= elements) {
        into[e]->assign(phase.angle_rad.size(), 0.0);
      } else if (angle[e] == angle[0]) {
        *into[e] = std::move(value[e]);
      } else {
        if (!std::ranges::is_sorted(angle[e], std::less_equal<>())) {
          refuse("angle", "must increase or fall strictly");
        }
        for (const double a : phase.angle_rad)
          into[e]->push_back(interpolated(angle[e], value[e], a));
      }
    }
    if (elements == 1) phase.p33 = unpolarised_p33(phase.angle_rad, phase.p11);
    normalise_imported(phase, refuse);
    return phase;
  }

  static double interpolated(const std::vector<double>& x, const std::vector<double>& y,
                             double at) {
    const auto above = std::ranges::upper_bound(x, at);
    if (above == x.begin()) return y.front();
    if (above == x.end()) return y.back();
    const auto i = static_cast<std::size_t>(above - x.begin());
    return std::lerp(y[i - 1], y[i], (at - x[i - 1]) / (x[i] - x[i - 1]));
  }

  void read_asymmetry() {
    if (file_.has_variable("gg")) {
      const std::vector<double> g = table("gg");
      for (std::size_t w = 0; w < W_; ++w) {
        for (std::size_t h = 0; h < H_; ++h) {
          if (!(std::abs(g[w * H_ + h]) < 1.0)) {
            file_.refuse_variable(
                "gg", "is " + shown(g[w * H_ + h]) + at(w, h) + ": must be within (-1, 1)");
          }
          optics_.optics[optics_.index(h, w)].asymmetry = g[w * H_ + h];
        }
      }
    } else if (!optics_.phase.empty()) {
      for (std::size_t i = 0; i < optics_.optics.size(); ++i) {
        optics_.optics[i].asymmetry = phase_asymmetry(optics_.phase[i]);
      }
    } else {
      file_.refuse(
          "has none of the variables 'gg', 'phase' with 'theta', 'pmom': the angular "
          "distribution of scattering is missing");
    }
  }

  void restore_order() {
    if (W_ < 2 || optics_.wavelength_nm[0] < optics_.wavelength_nm[1]) return;
    std::ranges::reverse(optics_.wavelength_nm);
    for (std::size_t h = 0; h < H_; ++h) {
      const auto turn = [&](auto& values) {
        const auto start = values.begin() + static_cast<std::ptrdiff_t>(h * W_);
        std::reverse(start, start + static_cast<std::ptrdiff_t>(W_));
      };
      turn(optics_.optics);
      if (!optics_.phase.empty()) turn(optics_.phase);
    }
  }

  void make_shape() {
    std::vector<std::size_t> order(W_);
    for (std::size_t w = 0; w < W_; ++w) order[w] = w;
    std::ranges::sort(order, {}, [&](std::size_t w) { return optics_.wavelength_nm[w]; });
    std::vector<double> nm, extinction;
    for (const std::size_t w : order) {
      nm.push_back(optics_.wavelength_nm[w]);
      extinction.push_back(optics_.optics[optics_.index(0, w)].extinction_per_km());
    }
    if (nm.front() > kShapeWavelengthNm || nm.back() < kShapeWavelengthNm) {
      file_.refuse_variable("wavelen",
                            "does not enclose 550 nm, at which extinction without particles or "
                            "mass to refer to is normalised");
    }
    const double scale = 1.0 / interpolated(nm, extinction, kShapeWavelengthNm);
    for (ComponentOptics& o : optics_.optics) {
      o.scattering_per_km *= scale;
      o.absorption_per_km *= scale;
    }
  }

  const NetcdfReader& file_;
  ParticleOptics optics_;
  std::string state_;  // dimension: nhum or nreff
  std::size_t W_ = 0, H_ = 0;
};

}  // namespace

bool is_libradtran_optics(const NetcdfReader& file) {
  return file.has_variable("wavelen") && file.has_variable("ext") && file.has_variable("ssa");
}

ParticleOptics read_libradtran_optics(const NetcdfReader& file) {
  return LibradtranReader(file).read();
}

}  // namespace twilight
