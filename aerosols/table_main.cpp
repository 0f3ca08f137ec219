// twilight_aerosol_table: makes component_optics_table.inc from the microphysics.
#include <atomic>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iomanip>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "aerosols/component_mie.h"
#include "aerosols/component_optics.h"
#include "aerosols/components.h"

namespace {

using namespace twilight;

std::vector<ComponentOptics> compute_rows() {
  std::vector<ComponentOptics> rows(kComponentStates * kTableWavelengths);
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < rows.size(); i = next++) {
      rows[i] = integrate_component(component_states()[i / kTableWavelengths],
                                    kTableWavelength_nm[i % kTableWavelengths]);
    }
  };
  std::vector<std::jthread> workers;
  for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) workers.emplace_back(work);
  work();
  workers.clear();  // joins
  return rows;
}

void write_rows(const std::vector<ComponentOptics>& rows, const std::string& path) {
  std::ofstream out(path);
  if (!out) throw std::runtime_error("cannot write " + path);
  out << "// GENERATED, do not edit. Made by\n"
         "//   twilight_aerosol_table aerosols/component_optics_table.inc\n"
         "// Mie integrals ("
      << kRadiiPerEfold
      << " radii per e-fold) over the component states of components.cpp.\n"
         "// Row: scattering, absorption (km^-1 per particle cm^-3), asymmetry.\n"
         "// clang-format off\n"
      << std::scientific << std::setprecision(8);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ComponentState& state = component_states()[i / kTableWavelengths];
    out << '{' << rows[i].scattering_per_km << ", " << rows[i].absorption_per_km << ", "
        << rows[i].asymmetry << "},  // " << component_code(state.component) << ' '
        << static_cast<int>(state.relative_humidity_percent) << " % " << std::defaultfloat
        << kTableWavelength_nm[i % kTableWavelengths] << std::scientific << " nm\n";
  }
  out << "// clang-format on\n";
  out.close();
  if (!out) throw std::runtime_error("error while writing " + path);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: twilight_aerosol_table OUTPUT.inc\n");
    return 2;
  }
  try {
    write_rows(compute_rows(), argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "twilight_aerosol_table: %s\n", error.what());
    return 1;
  }
  return 0;
}
