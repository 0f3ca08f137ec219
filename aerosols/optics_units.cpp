#include "aerosols/optics_units.h"

#include <algorithm>
#include <cctype>
#include <numbers>
#include <span>
#include <string>

namespace twilight {
namespace {

struct NamedUnit {
  std::string_view name;
  double value;
};

// Without blanks, in small letters.
std::string plain(std::string_view unit) {
  std::string text;
  for (const char c : unit) {
    if (c != ' ' && c != '\t' && c != '\0') {
      text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return text;
}

std::optional<double> among(std::span<const NamedUnit> units, std::string_view unit) {
  const std::string wanted = plain(unit);
  const auto found = std::ranges::find(units, wanted, &NamedUnit::name);
  if (found == units.end()) return std::nullopt;
  return found->value;
}

}  // namespace

std::optional<double> nm_in(std::string_view unit) {
  static constexpr NamedUnit kUnits[] = {
      {"nm", 1.0},         {"nanometer", 1.0},   {"nanometers", 1.0}, {"nanometre", 1.0},
      {"um", 1e3},         {"\xC2\xB5m", 1e3},   {"micron", 1e3},     {"microns", 1e3},
      {"micrometer", 1e3}, {"micrometers", 1e3}, {"micrometre", 1e3}, {"[um]", 1e3},
      {"m", 1e9},          {"meter", 1e9},       {"metre", 1e9}};
  return among(kUnits, unit);
}

std::optional<double> degrees_in(std::string_view unit) {
  constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
  static constexpr NamedUnit kUnits[] = {{"degree", 1.0},
                                         {"degrees", 1.0},
                                         {"deg", 1.0},
                                         {"radian", kDegreesPerRadian},
                                         {"radians", kDegreesPerRadian},
                                         {"rad", kDegreesPerRadian}};
  return among(kUnits, unit);
}

std::optional<double> percent_in(std::string_view unit) {
  static constexpr NamedUnit kUnits[] = {
      {"percent", 1.0}, {"%", 1.0}, {"1", 100.0}, {"fraction", 100.0}};
  return among(kUnits, unit);
}

std::optional<CoefficientUnit> coefficient_unit(std::string_view unit) {
  struct Named {
    std::string_view name;
    CoefficientUnit unit;
  };
  constexpr auto kMass = OpticsPer::kMicrogramPerM3;
  constexpr auto kParticle = OpticsPer::kParticlePerCm3;
  constexpr auto kAir = OpticsPer::kExtinctionAt550nm;
  // 1 m^2/g = 1 m^-1 of 1 g m^-3 = 1e3 km^-1 of 1e6 ug m^-3; 1 um^2 cm^-3 = 1e-3 km^-1.
  static constexpr Named kUnits[] = {{"km^-1/(g/m^3)", {kMass, 1e-6}},
                                     {"km-1/(g/m3)", {kMass, 1e-6}},
                                     {"km^-1g^-1m^3", {kMass, 1e-6}},
                                     {"km-1g-1m3", {kMass, 1e-6}},
                                     {"km-1ug-1m3", {kMass, 1.0}},
                                     {"m^2/g", {kMass, 1e-3}},
                                     {"m2/g", {kMass, 1e-3}},
                                     {"m2g-1", {kMass, 1e-3}},
                                     {"m^2g^-1", {kMass, 1e-3}},
                                     {"m2kg-1", {kMass, 1e-6}},
                                     {"m^2/kg", {kMass, 1e-6}},
                                     {"m2/kg", {kMass, 1e-6}},
                                     {"km-1cm3", {kParticle, 1.0}},
                                     {"km^-1cm^3", {kParticle, 1.0}},
                                     {"um2", {kParticle, 1e-3}},
                                     {"um^2", {kParticle, 1e-3}},
                                     {"micrometer^2", {kParticle, 1e-3}},
                                     {"cm2", {kParticle, 1e5}},
                                     {"cm^2", {kParticle, 1e5}},
                                     {"m2", {kParticle, 1e9}},
                                     {"m^2", {kParticle, 1e9}},
                                     {"km-1", {kAir, 1.0}},
                                     {"km^-1", {kAir, 1.0}},
                                     {"1/km", {kAir, 1.0}},
                                     {"[1/km]", {kAir, 1.0}},
                                     {"m-1", {kAir, 1e3}},
                                     {"m^-1", {kAir, 1e3}},
                                     {"1/m", {kAir, 1e3}}};
  const std::string wanted = plain(unit);
  const auto found = std::ranges::find(kUnits, wanted, &Named::name);
  if (found == std::end(kUnits)) return std::nullopt;
  return found->unit;
}

std::string_view coefficient_unit_text(OpticsPer per) {
  switch (per) {
    case OpticsPer::kParticlePerCm3:
      return "km-1 cm3";
    case OpticsPer::kMicrogramPerM3:
      return "km-1 ug-1 m3";
    case OpticsPer::kExtinctionAt550nm:
      return "km-1";
  }
  return "";
}

}  // namespace twilight
