#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "output/atomic_file.h"
#include "output/exr_image.h"
#include "output/preview.h"
#include "tests/output/fake_sky.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

/// A folder of its own, gone at the end.
class ImageFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("twilight_output_" + std::to_string(::getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
};

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

SkyMap small_map(Projection projection, MapColour colour = MapColour::kLinearRec709) {
  const FakeSky sky(fifteen_wavelengths_nm(), dusk_formula);
  const ColourIntegrator integrator(sky.wavelength_nm(), FakeSky::solar_irradiance_at,
                                    ColourObserver::kCie1931);
  return render_map(sky, integrator,
                    {.projection = projection,
                     .size = 16,
                     .sun_azimuth_rad = std::numbers::pi,
                     .colour = colour,
                     .spectral = true});
}

std::vector<float> read_channel(OIIO::ImageInput& input, const std::string& name) {
  const auto& spec = input.spec();
  const int channel = spec.channelindex(name);
  std::vector<float> all(static_cast<std::size_t>(spec.width * spec.height * spec.nchannels));
  if (channel < 0 || !input.read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, all.data()))
    return {};
  std::vector<float> values;
  for (std::size_t i = static_cast<std::size_t>(channel); i < all.size();
       i += static_cast<std::size_t>(spec.nchannels)) {
    values.push_back(all[i]);
  }
  return values;
}

std::vector<float> channel_of(const SkyImage& image, std::size_t channel) {
  std::vector<float> values;
  for (std::size_t i = channel; i < image.pixels.size(); i += image.channels.size()) {
    values.push_back(image.pixels[i]);
  }
  return values;
}

TEST_F(ImageFile, ColourMapReadsBackBitForBit) {
  const auto map = small_map(Projection::kLatLong);
  const auto path = folder_ / "sky.exr";
  write_exr(path, map.colour, Projection::kLatLong,
            {{"twilight:place", "Saarbr\u00fccken"},
             {"twilight:sunElevationDeg", -4.25},
             {"twilight:size", std::int32_t{16}},
             {"exposure", 0.5f}});
  const auto input = OIIO::ImageInput::open(path.string());
  ASSERT_TRUE(input);
  const auto& spec = input->spec();
  EXPECT_EQ(spec.width, 32);
  EXPECT_EQ(spec.height, 16);
  EXPECT_EQ(spec.format, OIIO::TypeDesc::FLOAT);
  EXPECT_EQ(spec.tile_width, 0);
  EXPECT_EQ(spec.get_string_attribute("compression"), "zip");
  EXPECT_EQ(spec.get_string_attribute("twilight:place"), "Saarbr\u00fccken");
  EXPECT_EQ(spec.get_float_attribute("twilight:sunElevationDeg"), -4.25f);
  EXPECT_EQ(spec.get_int_attribute("twilight:size"), 16);
  EXPECT_EQ(spec.get_float_attribute("whiteLuminance"), 683.0f);
  float chromaticities[8] = {};
  ASSERT_TRUE(spec.getattribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8),
                                chromaticities));
  const float rec709[8] = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
  for (int i = 0; i < 8; ++i) EXPECT_EQ(chromaticities[i], rec709[i]);
  // No envmap attribute: its convention has samples on the map's border.
  EXPECT_EQ(spec.find_attribute("textureformat"), nullptr);
  EXPECT_EQ(spec.get_string_attribute("projection"), "latlong");
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(read_channel(*input, map.colour.channels[c]), channel_of(map.colour, c));
  }
  EXPECT_EQ(files(), 1u);
}

TEST_F(ImageFile, XyzMapHasItsOwnChannelNames) {
  const auto map = small_map(Projection::kFisheye, MapColour::kXyz);
  write_exr(folder_ / "sky.exr", map.colour, Projection::kFisheye);
  const auto input = OIIO::ImageInput::open((folder_ / "sky.exr").string());
  ASSERT_TRUE(input);
  EXPECT_EQ(input->spec().find_attribute("textureformat"), nullptr);
  EXPECT_EQ(input->spec().find_attribute("chromaticities"), nullptr);
  EXPECT_EQ(read_channel(*input, "Y"), channel_of(map.colour, 1));
}

// Fichet, Pacanowski & Wilkie 2021: S0.<wavelength with a decimal comma>nm.
TEST_F(ImageFile, SpectralMapFollowsTheLayout) {
  EXPECT_EQ(spectral_channel_name(550.0), "S0.550,000nm");
  EXPECT_EQ(spectral_channel_name(412.5), "S0.412,500nm");
  EXPECT_THROW(spectral_channel_name(-1.0), std::invalid_argument);
  const auto map = small_map(Projection::kOctahedral);
  const auto path = folder_ / "spectral.exr";
  write_spectral_exr(path, *map.spectral, &map.colour, Projection::kOctahedral);
  const auto input = OIIO::ImageInput::open(path.string());
  ASSERT_TRUE(input);
  const auto& spec = input->spec();
  EXPECT_EQ(spec.nchannels, 18);
  EXPECT_EQ(spec.get_string_attribute("spectralLayoutVersion"), "1.0");
  EXPECT_EQ(spec.get_string_attribute("emissiveUnits"), "W.m^-2.sr^-1");
  EXPECT_EQ(spec.get_string_attribute("radianceUnits"), "W.m^-2.sr^-1.nm^-1");
  EXPECT_EQ(read_channel(*input, "S0.470,000nm"), channel_of(*map.spectral, 3));
  EXPECT_EQ(read_channel(*input, "G"), channel_of(map.colour, 1));
}

TEST_F(ImageFile, SameImageSameBytes) {
  const auto map = small_map(Projection::kFisheye);
  write_exr(folder_ / "a.exr", map.colour, Projection::kFisheye, {{"x", 1.0}});
  write_exr(folder_ / "b.exr", map.colour, Projection::kFisheye, {{"x", 1.0}});
  EXPECT_EQ(bytes_of(folder_ / "a.exr"), bytes_of(folder_ / "b.exr"));
  write_preview_png(folder_ / "a.png", map.colour);
  write_preview_png(folder_ / "b.png", map.colour);
  EXPECT_EQ(bytes_of(folder_ / "a.png"), bytes_of(folder_ / "b.png"));
  EXPECT_GT(bytes_of(folder_ / "a.png").size(), 100u);
}

TEST_F(ImageFile, RefusesWhatIsNoRadiance) {
  for (float bad : {-1e-20f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    auto map = small_map(Projection::kFisheye);
    map.colour.pixels[100] = bad;
    map.spectral->pixels[100] = bad;
    EXPECT_THROW(write_exr(folder_ / "x.exr", map.colour, Projection::kFisheye), std::logic_error);
    EXPECT_THROW(
        write_spectral_exr(folder_ / "x.exr", *map.spectral, nullptr, Projection::kFisheye),
        std::logic_error);
    EXPECT_THROW(write_preview_png(folder_ / "x.png", map.colour), std::logic_error);
  }
  EXPECT_EQ(files(), 0u);
}

TEST_F(ImageFile, RefusesAttributesOfTheFormat) {
  const auto map = small_map(Projection::kFisheye);
  for (const char* name : {"", "channels", "compression", "chromaticities", "type"}) {
    EXPECT_THROW(write_exr(folder_ / "x.exr", map.colour, Projection::kFisheye, {{name, "v"}}),
                 std::invalid_argument)
        << name;
  }
  EXPECT_THROW(write_exr(folder_ / "x.exr", map.colour, Projection::kFisheye,
                         {{"twice", 1.0}, {"twice", 2.0}}),
               std::invalid_argument);
  EXPECT_EQ(files(), 0u);
}

TEST_F(ImageFile, FailureNamesThePathAndLeavesNothing) {
  const auto map = small_map(Projection::kFisheye);
  const auto expect_failure = [&](const fs::path& path, const std::string& reason) {
    for (int kind = 0; kind < 2; ++kind) {
      try {
        if (kind == 0) {
          write_exr(path, map.colour, Projection::kFisheye);
        } else {
          write_preview_png(path, map.colour);
        }
        ADD_FAILURE() << path << " was written";
      } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find(path.string()), std::string::npos) << message;
        EXPECT_NE(message.find(reason), std::string::npos) << message;
      }
    }
  };
  expect_failure(folder_ / "missing" / "sky.exr", "No such file");
  expect_failure(folder_, "not a regular file");
  EXPECT_EQ(files(), 0u);
}

/// A disc that is full after 2048 bytes, for as long as it lives.
class SmallDisc {
 public:
  SmallDisc() {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit small = before_;
    small.rlim_cur = 2048;
    ::setrlimit(RLIMIT_FSIZE, &small);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
  }
  ~SmallDisc() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_ = {};
  void (*handler_)(int) = SIG_DFL;
};

TEST_F(ImageFile, FullDiscIsNoticedAndTheOldFileStays) {
  const FakeSky sky({450.0, 550.0, 650.0}, dusk_formula);
  const ColourIntegrator integrator(sky.wavelength_nm(), FakeSky::solar_irradiance_at,
                                    ColourObserver::kCie1931);
  const auto map = render_map(sky, integrator, {.size = 64, .sun_azimuth_rad = 0.3});
  std::ofstream(folder_ / "sky.exr") << "old";
  std::ofstream(folder_ / "sky.png") << "old";
  {
    const SmallDisc small;
    EXPECT_THROW(write_exr(folder_ / "sky.exr", map.colour, Projection::kFisheye),
                 std::runtime_error);
    EXPECT_THROW(write_preview_png(folder_ / "sky.png", map.colour), std::runtime_error);
  }
  EXPECT_EQ(bytes_of(folder_ / "sky.exr"), "old");
  EXPECT_EQ(bytes_of(folder_ / "sky.png"), "old");
  EXPECT_EQ(files(), 2u);
}

TEST_F(ImageFile, OldFileStaysUntilTheNewOneIsWhole) {
  const auto path = folder_ / "sky.txt";
  std::ofstream(path) << "old";
  {
    AtomicFile file(path);
    EXPECT_EQ(file.temporary().parent_path(), folder_);
    EXPECT_EQ(file.temporary().extension(), ".txt");
    EXPECT_EQ(file.temporary().filename().string()[0], '.');
    file.write("new");
    EXPECT_EQ(bytes_of(path), "old");
  }
  EXPECT_EQ(bytes_of(path), "old");
  EXPECT_EQ(files(), 1u);
  AtomicFile file(path);
  file.write("newer");
  file.commit();
  EXPECT_EQ(bytes_of(path), "newer");
  EXPECT_EQ(files(), 1u);
}

TEST_F(ImageFile, SymbolicLinkStaysALink) {
  std::ofstream(folder_ / "real.txt") << "old";
  fs::create_symlink(folder_ / "real.txt", folder_ / "link.txt");
  AtomicFile file(folder_ / "link.txt");
  file.write("new");
  file.commit();
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.txt"));
  EXPECT_EQ(bytes_of(folder_ / "real.txt"), "new");
}

}  // namespace
}  // namespace twilight
