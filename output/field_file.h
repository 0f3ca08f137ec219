// Solved fields of the "orders" method as netCDF files.
#pragma once

#include <filesystem>

#include "output/atomic_file.h"
#include "sim/orders_field.h"
#include "sim/scene_model.h"

namespace twilight {

/// Writes a field as netCDF (64-bit data, CDF-5) after the CF conventions 1.10: the coordinates
/// altitude (km), solar_zenith_angle (degree) and wavelength (nm), every array of the field, and
/// the medium and ground it was solved for. Global attributes hold the whole scene as TOML, the
/// Earth's radius and the program's version; each variable a checksum of its bytes. No time
/// stamp is written, so the bytes depend on the arguments alone.
///
/// The file appears whole or not at all; the variant with an AtomicFile leaves its commit to the
/// caller. Throws std::logic_error if an array's size disagrees with its coordinates or a value is
/// not finite, std::runtime_error naming the path if writing fails.
void write_field(AtomicFile& file, const OrdersField& field, const SceneModel& model);
void write_field(const std::filesystem::path& path, const OrdersField& field,
                 const SceneModel& model);

/// Reads a field and makes sure that it was solved for the model: the scene's method is "orders";
/// earth, atmosphere, aerosols, spectrum, sun.disc_average and the solver's keys that shape the
/// field are equal, and so are the resolved Earth radius, the medium's layers and the ground's
/// albedo (relative 1e-9). The Sun's place and spectrum, observer, output, threads and every key of
/// other methods are free; the Sun's distance (its disc's size, 3 % over the year) is not looked
/// at. The field equals the one written bit by bit.
///
/// Throws std::invalid_argument naming file, key and both values where the scenes differ;
/// std::runtime_error naming file and variable (or attribute) where the file cannot be read, is no
/// field, lacks something, has a wrong shape, holds a value that is not finite or is damaged.
OrdersField read_field(const std::filesystem::path& path, const SceneModel& model);

}  // namespace twilight
