#include "output/exr_image.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "output/atomic_file.h"

namespace twilight {
namespace {

/// Passes OpenEXR's bytes on to the temporary file. OutputFile writes its offset
/// table in its destructor and swallows what that throws, so a failure is kept.
class CheckedStream : public OPENEXR_IMF_NAMESPACE::OStream {
 public:
  explicit CheckedStream(AtomicFile& file) : OStream(file.temporary().c_str()), file_(file) {}

  void write(const char bytes[], int count) override {
    guarded([&] { file_.write(bytes, static_cast<std::size_t>(count)); });
    position_ += static_cast<std::uint64_t>(count);
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override {
    guarded([&] { file_.seek(position); });
    position_ = position;
  }
  void rethrow_failure() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  template <typename Action>
  void guarded(Action action) {
    try {
      action();
    } catch (...) {
      failure_ = std::current_exception();
      throw;
    }
  }

  AtomicFile& file_;
  std::uint64_t position_ = 0;
  std::exception_ptr failure_;
};

void check_image(const SkyImage& image) {
  const std::size_t expected = static_cast<std::size_t>(std::max(image.width, 0)) *
                               static_cast<std::size_t>(std::max(image.height, 0)) *
                               image.channels.size();
  if (expected == 0 || image.pixels.size() != expected) {
    throw std::logic_error(fmt::format("image of {} x {} pixels and {} channels holds {} values",
                                       image.width, image.height, image.channels.size(),
                                       image.pixels.size()));
  }
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float value = image.pixels[i];
    if (std::isfinite(value) && value >= 0.0f) continue;
    const std::size_t pixel = i / image.channels.size();
    const auto width = static_cast<std::size_t>(image.width);
    throw std::logic_error(fmt::format(
        "channel {} of pixel ({}, {}) is {}; it must be finite and "
        ">= 0",
        image.channels[i % image.channels.size()], pixel % width, pixel / width, value));
  }
}

void add_attributes(Imf::Header& header, const ImageAttributes& attributes) {
  for (const auto& [name, value] : attributes) {
    if (name.empty() || name.size() > 255) {
      throw std::invalid_argument(fmt::format(
          "image attribute name \"{}\" has {} characters; it must have 1..255", name, name.size()));
    }
    static constexpr std::string_view kFormatsOwn[] = {"type",       "name",  "version",
                                                       "chunkCount", "tiles", "view"};
    if (header.find(name.c_str()) != header.end() ||
        std::find(std::begin(kFormatsOwn), std::end(kFormatsOwn), name) != std::end(kFormatsOwn)) {
      throw std::invalid_argument(
          fmt::format("image attribute \"{}\" is given twice or is the file format's own", name));
    }
    if (const auto* text = std::get_if<std::string>(&value)) {
      header.insert(name, Imf::StringAttribute(*text));
    } else if (const auto* real = std::get_if<double>(&value)) {
      header.insert(name, Imf::DoubleAttribute(*real));
    } else if (const auto* single = std::get_if<float>(&value)) {
      header.insert(name, Imf::FloatAttribute(*single));
    } else {
      header.insert(name, Imf::IntAttribute(std::get<std::int32_t>(value)));
    }
  }
}

void add_rec709(Imf::Header& header) {
  const auto point = [](const std::array<double, 2>& xy) {
    return Imath::V2f(static_cast<float>(xy[0]), static_cast<float>(xy[1]));
  };
  Imf::addChromaticities(header, Imf::Chromaticities(point(Rec709::kRed), point(Rec709::kGreen),
                                                     point(Rec709::kBlue), point(Rec709::kWhite)));
  Imf::addWhiteLuminance(header, static_cast<float>(kLuminousEfficacy_lm_w));
}

Imf::Header header_for(const SkyImage& image, const MapProjection& projection) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.lineOrder() = Imf::INCREASING_Y;
  // OpenEXR's own `envmap` attribute would say that samples lie on the map's border.
  header.insert("projection", Imf::StringAttribute(std::string(projection_name(projection.kind))));
  if (projection.kind == Projection::kCamera) {
    constexpr double kDegrees = 180.0 / std::numbers::pi;
    const CameraView& camera = projection.camera;
    header.insert("cameraAzimuth", Imf::DoubleAttribute(camera.azimuth_rad * kDegrees));
    header.insert("cameraElevation", Imf::DoubleAttribute(camera.elevation_rad * kDegrees));
    header.insert("cameraFieldOfView", Imf::DoubleAttribute(camera.field_of_view_rad * kDegrees));
  }
  return header;
}

void add_channels(Imf::Header& header, Imf::FrameBuffer& frame, const SkyImage& image) {
  const std::size_t pixel_bytes = image.channels.size() * sizeof(float);
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    header.channels().insert(image.channels[c], Imf::Channel(Imf::FLOAT));
    // The frame buffer is only read from; the interface has no const version.
    char* base = const_cast<char*>(reinterpret_cast<const char*>(image.pixels.data() + c));
    frame.insert(image.channels[c],
                 Imf::Slice(Imf::FLOAT, base, pixel_bytes,
                            pixel_bytes * static_cast<std::size_t>(image.width)));
  }
}

void write_file(AtomicFile& file, const Imf::Header& header, const Imf::FrameBuffer& frame,
                int height) {
  CheckedStream stream(file);
  // Chunks are compressed each on its own: the same bytes for any number of threads.
  if (Imf::globalThreadCount() == 0) {
    Imf::setGlobalThreadCount(static_cast<int>(std::thread::hardware_concurrency()));
  }
  try {
    Imf::OutputFile output(stream, header);
    output.setFrameBuffer(frame);
    output.writePixels(height);
  } catch (const std::exception& error) {
    stream.rethrow_failure();
    file.fail(error.what());
  }
  stream.rethrow_failure();
}

bool is_rgb(const SkyImage& image) {
  return image.channels == std::vector<std::string>{"R", "G", "B"};
}

}  // namespace

std::string spectral_channel_name(double wavelength_nm) {
  if (!(wavelength_nm > 0.0 && wavelength_nm < 1e6)) {
    throw std::invalid_argument(
        fmt::format("wavelength_nm is {}; it must be in (0, 1e6)", wavelength_nm));
  }
  std::string number = fmt::format("{:.3f}", wavelength_nm);
  std::replace(number.begin(), number.end(), '.', ',');
  return "S0." + number + "nm";
}

void write_exr(AtomicFile& file, const SkyImage& image, const MapProjection& projection,
               const ImageAttributes& attributes) {
  check_image(image);
  Imf::Header header = header_for(image, projection);
  if (is_rgb(image)) {
    add_rec709(header);
  } else {
    Imf::addWhiteLuminance(header, static_cast<float>(kLuminousEfficacy_lm_w));
  }
  add_attributes(header, attributes);
  Imf::FrameBuffer frame;
  add_channels(header, frame, image);
  write_file(file, header, frame, image.height);
}

void write_spectral_exr(AtomicFile& file, const SkyImage& spectral, const SkyImage* preview,
                        const MapProjection& projection, const ImageAttributes& attributes) {
  check_image(spectral);
  Imf::Header header = header_for(spectral, projection);
  header.insert("spectralLayoutVersion", Imf::StringAttribute("1.0"));
  header.insert("emissiveUnits", Imf::StringAttribute("W.m^-2.sr^-1"));
  header.insert("radianceUnits", Imf::StringAttribute("W.m^-2.sr^-1.nm^-1"));
  Imf::FrameBuffer frame;
  if (preview != nullptr) {
    check_image(*preview);
    if (!is_rgb(*preview) || preview->width != spectral.width ||
        preview->height != spectral.height) {
      throw std::logic_error(fmt::format(
          "preview of a spectral image is {} x {} pixels; it must be {} x {} with channels R, G, B",
          preview->width, preview->height, spectral.width, spectral.height));
    }
    add_rec709(header);
    add_channels(header, frame, *preview);
  }
  add_attributes(header, attributes);
  add_channels(header, frame, spectral);
  write_file(file, header, frame, spectral.height);
}

void write_rgba_exr(AtomicFile& file, int width, int height, std::span<const float> rgba, bool half,
                    const ImageAttributes& attributes) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (width < 1 || height < 1 || rgba.size() != 4 * pixels) {
    throw std::logic_error(
        fmt::format("table of {} x {} pixels holds {} values", width, height, rgba.size()));
  }
  for (const float value : rgba) {
    if (!std::isfinite(value)) throw std::logic_error("a value of a table is not finite");
  }
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.lineOrder() = Imf::INCREASING_Y;
  add_attributes(header, attributes);
  std::vector<Imath::half> halves;
  if (half) {
    halves.reserve(rgba.size());
    for (const float value : rgba) {
      halves.emplace_back(std::clamp(value, -65504.0F, 65504.0F));
    }
  }
  const std::size_t bytes = half ? sizeof(Imath::half) : sizeof(float);
  // The frame buffer is only read from; the interface has no const version.
  char* base = half ? reinterpret_cast<char*>(halves.data())
                    : const_cast<char*>(reinterpret_cast<const char*>(rgba.data()));
  Imf::FrameBuffer frame;
  const Imf::PixelType type = half ? Imf::HALF : Imf::FLOAT;
  std::size_t c = 0;
  for (const char* name : {"R", "G", "B", "A"}) {
    header.channels().insert(name, Imf::Channel(type));
    frame.insert(name, Imf::Slice(type, base + c++ * bytes, 4 * bytes,
                                  4 * bytes * static_cast<std::size_t>(width)));
  }
  write_file(file, header, frame, height);
}

void write_exr(const std::filesystem::path& path, const SkyImage& image,
               const MapProjection& projection, const ImageAttributes& attributes) {
  AtomicFile file(path);
  write_exr(file, image, projection, attributes);
  file.commit();
}

void write_spectral_exr(const std::filesystem::path& path, const SkyImage& spectral,
                        const SkyImage* preview, const MapProjection& projection,
                        const ImageAttributes& attributes) {
  AtomicFile file(path);
  write_spectral_exr(file, spectral, preview, projection, attributes);
  file.commit();
}

}  // namespace twilight
