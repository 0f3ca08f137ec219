#include "output/png_file.h"

#include <png.h>

#include <stdexcept>
#include <string>

namespace twilight {

std::vector<std::uint8_t> png_of(int width, int height, std::span<const std::uint8_t> rgb) {
  if (rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    throw std::logic_error("a picture has another number of pixels than its sizes say");
  }
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = PNG_FORMAT_RGB;  // 8 bits, sRGB
  // Into memory: libpng's own file writing would not name a full disc.
  std::vector<std::uint8_t> memory(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t size = memory.size();
  if (png_image_write_to_memory(&png, memory.data(), &size, 0, rgb.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("PNG: ") + png.message);
  }
  memory.resize(size);
  return memory;
}

void write_png(AtomicFile& file, int width, int height, std::span<const std::uint8_t> rgb) {
  const std::vector<std::uint8_t> bytes = png_of(width, height, rgb);
  file.write(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

}  // namespace twilight
