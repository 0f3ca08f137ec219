// netCDF files in the layout of libRadtran's mie tool, right or wrong, for tests.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "output/netcdf_writer.h"

namespace twilight {

/// What such a file holds. Every table is [wavelength][humidity][element][position].
struct LibradtranFile {
  std::vector<double> wavelen = {0.45, 0.55, 0.65};
  std::vector<double> hum = {0.0};
  std::size_t elements = 1;
  std::vector<double> ext, ssa, gg, rho;   ///< [wavelength][humidity]; gg, rho: empty = left out
  std::vector<double> theta, phase, pmom;  ///< empty = left out
  std::vector<double> counts;              ///< ntheta, nmom; empty: whole length
  bool reff = false;                       ///< nreff and reff in place of nhum and hum
  bool rho_by_humidity = false;            ///< rho(nhum), as MOPSMAP
  /// Units by variable; a variable without has none.
  std::map<std::string, std::string> units = {{"wavelen", "micrometer"},
                                              {"hum", "per cent"},
                                              {"theta", "degrees"},
                                              {"ext", "km^-1/(g/m^3)"},
                                              {"rho", "g/cm^3"}};
  std::string left_out;  ///< a variable

  std::size_t states() const { return wavelen.size() * hum.size(); }
  std::size_t length(const std::vector<double>& table) const {
    return table.size() / (states() * elements);
  }

  std::filesystem::path write(const std::filesystem::path& path) const {
    AtomicFile whole(path);
    NetcdfWriter file(whole);
    const std::string state = reff ? "nreff" : "nhum";
    file.dimension("nlam", wavelen.size());
    file.dimension(state, hum.size());
    file.dimension("nphamat", elements);
    std::vector<std::pair<std::string, const std::vector<double>*>> tables;
    const auto define = [&](const std::string& name, const std::vector<double>& values,
                            const std::vector<std::string>& dimensions,
                            NetcdfNumber type = NetcdfNumber::kDouble) {
      if (values.empty() || name == left_out) return;
      const auto unit = units.find(name);
      file.variable(name, type, dimensions, {unit == units.end() ? "" : unit->second, "", ""});
      tables.emplace_back(name, &values);
    };
    define("wavelen", wavelen, {"nlam"});
    define(reff ? "reff" : "hum", hum, {state});
    define("ext", ext, {"nlam", state});
    define("ssa", ssa, {"nlam", state});
    define("gg", gg, {"nlam", state});
    if (rho_by_humidity) {
      define("rho", rho, {state});
    } else {
      define("rho", rho, {"nlam", state});
    }
    const std::vector<std::string> counted = {"nlam", state, "nphamat"};
    std::vector<double> ntheta, nmom;
    if (!phase.empty()) {
      file.dimension("nthetamax", length(phase));
      ntheta = counts.empty()
                   ? std::vector<double>(states() * elements, static_cast<double>(length(phase)))
                   : counts;
      define("ntheta", ntheta, counted);
      define("theta", theta, {"nlam", state, "nphamat", "nthetamax"}, NetcdfNumber::kFloat);
      define("phase", phase, {"nlam", state, "nphamat", "nthetamax"}, NetcdfNumber::kFloat);
    }
    if (!pmom.empty()) {
      file.dimension("nmommax", length(pmom));
      nmom = counts.empty()
                 ? std::vector<double>(states() * elements, static_cast<double>(length(pmom)))
                 : counts;
      define("nmom", nmom, counted);
      define("pmom", pmom, {"nlam", state, "nphamat", "nmommax"}, NetcdfNumber::kFloat);
    }
    file.end_definitions();
    for (const auto& [name, values] : tables) file.put(name, *values);
    file.close();
    whole.commit();
    return path;
  }
};

/// Every state the same: Legendre moments of Henyey & Greenstein's function.
inline LibradtranFile henyey_greenstein_file(double g, std::size_t moments) {
  LibradtranFile file;
  file.ext.assign(file.states(), 2.0);
  file.ssa.assign(file.states(), 0.9);
  file.gg.assign(file.states(), g);
  for (std::size_t i = 0; i < file.states(); ++i) {
    double power = 1.0;
    for (std::size_t l = 0; l < moments; ++l, power *= g) {
      file.pmom.push_back((2.0 * static_cast<double>(l) + 1.0) * power);
    }
  }
  return file;
}

}  // namespace twilight
