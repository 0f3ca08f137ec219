#include "output/image_module.h"

#include <OpenImageIO/imageio.h>

#include <exception>
#include <memory>

namespace {

void read(const char* file, const std::vector<std::string>& names, twilight::ModuleImage& image) {
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(file);
  if (!input) {
    image.error = OIIO::geterror();
    if (image.error.empty()) image.error = "no format that is known";
    return;
  }
  const OIIO::ImageSpec& spec = input->spec();
  image.width = spec.width;
  image.height = spec.height;
  image.bytes_per_value = static_cast<int>(spec.format.basesize());
  image.alpha_channel = spec.alpha_channel;
  image.channels = spec.channelnames;
  image.pixels.resize(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
                      static_cast<std::size_t>(spec.nchannels));
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data())) {
    image.error = input->geterror();
    if (image.error.empty()) image.error = "it is damaged";
    return;
  }
  for (const std::string& name : names) {
    const OIIO::ParamValue* found = spec.find_attribute(name);
    if (found != nullptr) image.numbers[name] = static_cast<double>(found->get_float());
  }
}

}  // namespace

extern "C" __attribute__((visibility("default"))) void twilight_read_image(
    const char* file, const std::vector<std::string>& names, twilight::ModuleImage& image) {
  try {
    read(file, names, image);
  } catch (const std::exception& error) {
    image.error = error.what();
  }
}
