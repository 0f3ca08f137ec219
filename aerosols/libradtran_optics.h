// netCDF optical properties as libRadtran and MOPSMAP write and read them.
#pragma once

#include "aerosols/particle_optics.h"
#include "atmosphere/netcdf_reader.h"

namespace twilight {

/// Whether the file has the variables of such a file: wavelen, ext, ssa.
bool is_libradtran_optics(const NetcdfReader& file);

/// Reads a file of libRadtran's mie tool (output_user netcdf; the OPAC files *.mie.cdf) or of
/// MOPSMAP (output netcdf), which share one layout, slowest dimension first:
///   wavelen(nlam), hum(nhum) [or reff(nreff) of one size], ext(nlam, nhum), ssa(nlam, nhum),
///   optional gg(nlam, nhum), rho(nlam, nhum) or rho(nhum),
///   ntheta(nlam, nhum, nphamat), theta and phase(nlam, nhum, nphamat, nthetamax) and
///   nmom(nlam, nhum, nphamat), pmom(nlam, nhum, nphamat, nmommax).
/// The matrix is that of `phase`; where there is none, the Legendre series `pmom`, which holds the
/// factor 2l + 1. Elements in the order P11, P12, P33, -P34, P22, P44: the last two of MOPSMAP's
/// non-spherical particles are dropped. Angles may rise or fall. Without gg the asymmetry is the
/// mean cosine.
///
/// Units are taken from `units` and, where a file has none (MOPSMAP), are um, per cent, degrees,
/// km^-1/(g m^-3) and g cm^-3. Extinction per mass is that of the particle with its water; where
/// there are several humidities it is referred to dry mass with rho, volumes of dry matter and
/// water (1 g cm^-3) adding up: mass ratio (rho_0 - 1) rho / ((rho - 1) rho_0). Extinction of an
/// air with particles ("km-1") becomes a shape, 1 km^-1 at 550 nm, which the wavelengths must
/// enclose.
///
/// Throws std::runtime_error "FILE: variable 'NAME' ..." or std::invalid_argument "FILE: ..." for
/// what is wrong.
ParticleOptics read_libradtran_optics(const NetcdfReader& file);

}  // namespace twilight
