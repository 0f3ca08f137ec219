// Sky images as OpenEXR files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "output/atomic_file.h"
#include "output/projection.h"
#include "output/sky_image.h"

namespace twilight {

/// Facts stored in the image's header: place, time, Sun, every resolved setting, version.
using ImageAttribute =
    std::pair<std::string, std::variant<std::string, double, float, std::int32_t>>;
using ImageAttributes = std::vector<ImageAttribute>;

/// Writes a colour map: FLOAT channels as the image names them (R, G, B or X, Y,
/// Z), ZIP compression, scan lines. Attributes: `whiteLuminance` 683 cd/m^2;
/// `chromaticities` of Rec. 709 with D65 where there are R, G, B; `projection`, its
/// name, and a camera's `cameraAzimuth`, `cameraElevation`, `cameraFieldOfView` (degrees; the last
/// from bottom to top); then the given ones. No time stamp is
/// written, so the bytes depend on the arguments alone.
///
/// The file appears whole or not at all. Throws std::logic_error if a pixel is
/// negative or not finite or the image's sizes disagree; std::invalid_argument
/// if an attribute's name is empty, given twice or one the format uses itself;
/// std::runtime_error naming the path if writing fails.
/// The variants with an AtomicFile leave its commit to the caller, so that several
/// files can appear together.
void write_exr(AtomicFile& file, const SkyImage& image, const MapProjection& projection,
               const ImageAttributes& attributes = {});
void write_exr(const std::filesystem::path& path, const SkyImage& image,
               const MapProjection& projection, const ImageAttributes& attributes = {});

/// Writes a spectral map in the layout of Fichet, Pacanowski & Wilkie (2021, "An
/// OpenEXR Layout for Spectral Images", JCGT 10(3)), version 1.0: one channel
/// S0.<wavelength>nm per wavelength, and the channels R, G, B of `preview` (same
/// size, linear Rec. 709) if it is not null. Otherwise as write_exr.
///
/// Attribute `emissiveUnits` is "W.m^-2.sr^-1", the one value that version 1.0's
/// readers accept; the values are per nanometre, as the wavelength's unit in the
/// channel names implies, and `radianceUnits` says so: "W.m^-2.sr^-1.nm^-1".
void write_spectral_exr(AtomicFile& file, const SkyImage& spectral, const SkyImage* preview,
                        const MapProjection& projection, const ImageAttributes& attributes = {});
void write_spectral_exr(const std::filesystem::path& path, const SkyImage& spectral,
                        const SkyImage* preview, const MapProjection& projection,
                        const ImageAttributes& attributes = {});

/// Writes a table as an image of channels R, G, B, A (interleaved values of any sign, width x
/// height x 4), FLOAT or, rounded and cut off at 65504, HALF; ZIP compression, attributes as
/// write_exr. Throws as that, std::logic_error where a value is not finite or sizes disagree.
void write_rgba_exr(AtomicFile& file, int width, int height, std::span<const float> rgba, bool half,
                    const ImageAttributes& attributes = {});

/// "S0.550,000nm" for 550: the layout's decimal sign is the comma, the dot
/// parts layers. Throws std::invalid_argument unless 0 < wavelength_nm < 1e6.
std::string spectral_channel_name(double wavelength_nm);

}  // namespace twilight
