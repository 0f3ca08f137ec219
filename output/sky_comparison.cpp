#include "output/sky_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "output/hemisphere.h"
#include "output/scene_colour.h"
#include "output/tradeoff.h"
#include "sim/elapsed_time.h"
#include "sim/scene_file.h"
#include "sim/scene_model.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;
using std::numbers::pi;

constexpr double kRadPerDeg = pi / 180;
constexpr const char* kUsualSuns = "60,30,10,5,2,0,-2,-4,-6,-9,-12";
constexpr const char* kElevationAttribute = "resolved.sun_elevation_deg";
constexpr const char* kAzimuthAttribute = "resolved.sun_azimuth_deg";

// "method,key=value,key=[1,2]": parts at commas outside brackets.
std::vector<std::string> parts_of(std::string_view text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : text) {
    if (c == '[') ++depth;
    if (c == ']') --depth;
    if (c == ',' && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

// Sun and picture are the comparison's own.
void require_own_settings(const std::string& label, const std::vector<std::string>& parts) {
  for (std::size_t k = 1; k < parts.size(); ++k) {
    for (const char* taken :
         {"solver.method=", "sun.elevation_deg=", "observer.time=", "output.", "spectrum.wav"}) {
      if (!parts[k].starts_with(taken)) continue;
      throw std::invalid_argument(fmt::format(
          "{}: '{}': must not be set for one sky alone: the comparison says method, Sun, "
          "wavelengths and pictures",
          label, parts[k]));
    }
  }
}

Scene scene_of(const ComparisonOptions& options, const std::vector<std::string>& parts) {
  std::vector<std::string> overrides = options.overrides;
  overrides.push_back("solver.method=" + parts.front());
  overrides.insert(overrides.end(), parts.begin() + 1, parts.end());
  Scene scene =
      (options.scene ? load_scene(*options.scene, overrides)
                     : load_scene_text("[sun]\nelevation_deg = 30\n", "defaults", overrides))
          .scene;
  // Its levels are in the solver's keys already; a budget would choose another method.
  scene.quality.reset();
  scene.budget = {};
  return scene;
}

StoredMap image_of(const ComparisonOptions& options, const std::string& path) {
  StoredMap map = read_exr_map(path);
  if (!map.image.projection && options.projection) {
    map.image.projection = projection_from_name(*options.projection);
  }
  if (!map.image.projection) {
    throw std::invalid_argument(fmt::format(
        "{}: says no projection of ours: give --projection fisheye, latlong or octahedral", path));
  }
  const MapProjection& projection = *map.image.projection;
  const int size = map.image.height;
  if (map_width(projection, size) != map.image.width) {
    throw std::invalid_argument(fmt::format("{}: is {} x {} pixels: a {} map is {} x {}", path,
                                            map.image.width, size, projection_name(projection.kind),
                                            map_width(projection, size), size));
  }
  return map;
}

// Images under different Suns, or another than --suns, say nothing of each other.
void require_one_sun(const ComparisonPlan& plan) {
  constexpr double kSameSun_deg = 0.01;
  const Contender* first = nullptr;
  for (const Contender& c : plan.contenders) {
    if (!c.image || !c.image->numbers.contains(kElevationAttribute)) continue;
    const double sun = c.image->numbers.at(kElevationAttribute);
    double wanted = sun;
    if (!plan.options.suns.empty()) wanted = parse_suns(plan.options.suns, false).front();
    if (first != nullptr) wanted = first->image->numbers.at(kElevationAttribute);
    if (first == nullptr) first = &c;
    if (std::abs(sun - wanted) <= kSameSun_deg) continue;
    throw std::invalid_argument(
        fmt::format("{}: its Sun stands at {:.6g} degrees: must be {:.6g} as "
                    "{}",
                    c.label, sun, wanted, first == &c ? "--suns says" : first->label));
  }
}

// The images' Sun, or the scene's where they do not say.
void place_sun(ComparisonPlan& plan) {
  const StoredMap* map = nullptr;
  const Scene* scene = nullptr;
  for (const Contender& c : plan.contenders) {
    if (c.image && (map == nullptr || !map->numbers.contains(kElevationAttribute))) map = &*c.image;
    if (c.scene && scene == nullptr) scene = &*c.scene;
  }
  if (map == nullptr) {
    plan.suns_deg = parse_suns(plan.options.suns.empty() ? kUsualSuns : plan.options.suns, false);
    plan.sun_azimuth_rad = scene->sun.azimuth_deg * kRadPerDeg;
    return;
  }
  require_one_sun(plan);
  if (!plan.options.suns.empty()) {
    plan.suns_deg = parse_suns(plan.options.suns, false);
  } else if (map->numbers.contains(kElevationAttribute)) {
    plan.suns_deg = {map->numbers.at(kElevationAttribute)};
  }
  if (plan.suns_deg.size() > 1 || (plan.suns_deg.empty() && scene != nullptr)) {
    throw std::invalid_argument(
        fmt::format("--suns {}: must be one elevation in -18..90 degrees, the images' own, where "
                    "an image takes "
                    "part{}",
                    plan.options.suns, plan.suns_deg.empty() ? " that does not say it" : ""));
  }
  plan.sun_azimuth_rad = scene != nullptr ? scene->sun.azimuth_deg * kRadPerDeg : 0.0;
  if (map->numbers.contains(kAzimuthAttribute)) {
    plan.sun_azimuth_rad = map->numbers.at(kAzimuthAttribute) * kRadPerDeg;
  }
}

/// Where the contenders are looked at: relative to the Sun for skies, on the sphere for images. The
/// last is the zenith, which weighs nothing.
struct Views {
  std::vector<ViewDirection> relative;
  std::vector<double> solid_angle_sr;
  double sun_azimuth_rad = 0;

  void add(ViewDirection view, double solid_angle) {
    relative.push_back(view);
    solid_angle_sr.push_back(solid_angle);
  }
  MapDirection absolute(std::size_t k) const {
    const double turn = std::fmod(relative[k].relative_azimuth_rad + sun_azimuth_rad, 2 * pi);
    return {relative[k].elevation_rad, turn < 0 ? turn + 2 * pi : turn};
  }
};

Views views_of(const ComparisonPlan& plan) {
  Views views;
  views.sun_azimuth_rad = plan.sun_azimuth_rad;
  const auto with_image =
      std::ranges::find_if(plan.contenders, [](const Contender& c) { return c.image.has_value(); });
  if (with_image == plan.contenders.end()) {
    for (const WeightedView& v : hemisphere_views()) views.add(v.direction, v.solid_angle_sr);
  } else {
    const SkyImage& image = with_image->image->image;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const auto d = direction_of_pixel(*image.projection, image.height, x, y);
        if (!d || d->elevation_rad <= 0) continue;
        views.add({d->elevation_rad, d->azimuth_rad - plan.sun_azimuth_rad},
                  pixel_solid_angle_sr(*image.projection, image.height, x, y));
      }
    }
  }
  views.add({pi / 2, 0}, 0);
  return views;
}

// What an image does not show.
constexpr Tristimulus kUnseen = {std::numeric_limits<double>::quiet_NaN(),
                                 std::numeric_limits<double>::quiet_NaN(),
                                 std::numeric_limits<double>::quiet_NaN()};

/// One contender under one Sun.
struct Look {
  std::vector<double> radiance;  ///< [view][wavelength]; none of images
  std::vector<Tristimulus> xyz;  ///< [view], W m^-2 sr^-1
};

// Nothing outside its frame, and where the nearest pixel's centre is not sky: at the very horizon.
std::optional<Tristimulus> pixel_xyz(const StoredMap& map, MapDirection direction) {
  const SkyImage& image = map.image;
  const auto at = pixel_of_direction(*image.projection, image.height, direction);
  if (!at) return std::nullopt;
  const int column = std::clamp(static_cast<int>(at->x), 0, image.width - 1);
  const int line = std::clamp(static_cast<int>(at->y), 0, image.height - 1);
  const auto centre = direction_of_pixel(*image.projection, image.height, column, line);
  if (!centre || centre->elevation_rad <= 0) return std::nullopt;
  const auto x = static_cast<std::size_t>(column), y = static_cast<std::size_t>(line);
  const float* p = &image.pixels[3 * (y * static_cast<std::size_t>(image.width) + x)];
  const Tristimulus v = {static_cast<double>(p[0]), static_cast<double>(p[1]),
                         static_cast<double>(p[2])};
  const double scale = map.white_luminance_cd_m2 / kLuminousEfficacy_lm_w;
  Tristimulus xyz{};
  for (std::size_t r = 0; r < 3; ++r) {
    if (image.channels[0] == "X") {
      xyz[r] = scale * v[r];
      continue;
    }
    for (std::size_t c = 0; c < 3; ++c) xyz[r] += scale * xyz_from_rec709()[r][c] * v[c];
  }
  return xyz;
}

// The pixels of a fisheye of the hemisphere, X, Y, Z.
SkyImage image_picture(const StoredMap& map, int size) {
  SkyImage picture{size, size, {"X", "Y", "Z"}, {}, Projection::kFisheye};
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const auto d = direction_of_pixel(Projection::kFisheye, size, x, y);
      const Tristimulus xyz =
          (d ? pixel_xyz(map, *d) : std::nullopt).value_or(Tristimulus{0, 0, 0});
      for (const double v : xyz) picture.pixels.push_back(static_cast<float>(std::max(0.0, v)));
    }
  }
  return picture;
}

std::array<double, 2> difference(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return {a[0] - b[0], a[1] - b[1]};
}

void compare_radiance(const Look& sky, const Look& reference, const Views& views,
                      SkyErrors& errors) {
  if (sky.radiance.empty() || sky.radiance.size() != reference.radiance.size()) return;
  const std::size_t W = sky.radiance.size() / views.relative.size();
  double squares = 0, weight = 0, sizes = 0, lit = 0, largest = 0;
  for (std::size_t k = 0; k < sky.radiance.size(); ++k) {
    const double w = views.solid_angle_sr[k / W];
    const double a = sky.radiance[k], b = reference.radiance[k];
    squares += w * (a - b) * (a - b);
    weight += w;
    if (!(b > 0) || !(w > 0)) continue;
    const double relative = std::abs(a / b - 1);
    sizes += w * relative;
    lit += w;
    largest = std::max(largest, relative);
  }
  errors.radiance_rmse = std::sqrt(squares / weight);
  if (!(lit > 0)) return;
  errors.radiance_mean_relative = sizes / lit;
  errors.radiance_max_relative = largest;
}

SkyErrors errors_of(const Look& sky, const Look& reference, const Views& views) {
  SkyErrors e;
  compare_radiance(sky, reference, views, e);
  double squares = 0, weight = 0, sizes = 0, signs = 0, lit = 0, distances = 0, coloured = 0;
  for (std::size_t k = 0; k < views.relative.size(); ++k) {
    const double w = views.solid_angle_sr[k];
    const Tristimulus &a = sky.xyz[k], &b = reference.xyz[k];
    if (std::isnan(a[1]) || std::isnan(b[1])) continue;
    const double step = kLuminousEfficacy_lm_w * (a[1] - b[1]);
    squares += w * step * step;
    weight += w;
    if (!(w > 0) || !(b[1] > 0)) continue;
    const double relative = a[1] / b[1] - 1;
    sizes += w * std::abs(relative);
    signs += w * relative;
    lit += w;
    e.luminance_max_relative = std::max(e.luminance_max_relative, std::abs(relative));
    if (!(a[1] > 0)) continue;
    const auto d = difference(ucs_chromaticity(a), ucs_chromaticity(b));
    const double distance = std::hypot(d[0], d[1]);
    distances += w * distance;
    coloured += w;
    e.chromaticity_max = std::max(e.chromaticity_max, distance);
  }
  if (weight > 0) e.luminance_rmse_cd_m2 = std::sqrt(squares / weight);
  if (lit > 0) {
    e.luminance_mean_relative = sizes / lit;
    e.luminance_bias = signs / lit;
  }
  if (coloured > 0) e.chromaticity_mean = distances / coloured;
  if (reference.xyz.back()[1] > 0 && sky.xyz.back()[1] >= 0) {
    e.zenith_luminance_ratio = sky.xyz.back()[1] / reference.xyz.back()[1];
  }
  return e;
}

/// A contender that is solved, and what its Suns share.
class SolvedContender {
 public:
  explicit SolvedContender(const Scene& scene)
      : model_(build_scene_model(scene)),
        colour_(colour_integrator(model_, ColourObserver::kCie1931)) {}

  // Throws std::invalid_argument where the model is undefined.
  Look look(double sun_rad, const Views& views, const ComparisonPlan& plan, ComparisonRow& row,
            const RunControl& control) {
    const auto start = Clock::now();
    model_.sun_elevation_rad = sun_rad;
    std::unique_ptr<Sky> sky = first_ ? first_->with_sun_at(sun_rad) : nullptr;
    const Sky* seen = sky.get();
    if (!sky) {
      first_ = solve_sky(model_, control);
      seen = first_.get();
    }
    row.setup_seconds = seconds_since(start);
    const auto then = Clock::now();
    Look look;
    look.radiance = views.relative.size() > 1000 ? seen->map_radiance(views.relative)
                                                 : seen->radiance(views.relative);
    row.view_seconds = seconds_since(then);
    const std::size_t W = seen->wavelength_nm().size();
    for (std::size_t v = 0; v < views.relative.size(); ++v) {
      look.xyz.push_back(
          colour_.xyz(std::span(look.radiance).subspan(v * W, W), seen->solar_irradiance()));
    }
    row.clamps = seen->summary().clamps;
    if (plan.options.directory.empty()) return look;
    MapSettings settings;
    settings.size = plan.options.picture_size;
    settings.sun_azimuth_rad = plan.sun_azimuth_rad;
    settings.colour = MapColour::kXyz;
    row.picture = render_map(*seen, colour_, settings, control).colour;
    return look;
  }

 private:
  SceneModel model_;
  ColourIntegrator colour_;
  std::unique_ptr<Sky> first_;
};

Look look_at_image(const StoredMap& map, const Views& views, const ComparisonPlan& plan,
                   ComparisonRow& row) {
  Look look;
  for (std::size_t k = 0; k < views.relative.size(); ++k) {
    look.xyz.push_back(pixel_xyz(map, views.absolute(k)).value_or(kUnseen));
  }
  if (!plan.options.directory.empty()) row.picture = image_picture(map, plan.options.picture_size);
  return look;
}

void require_same_wavelengths(const ComparisonPlan& plan) {
  const Scene* first = nullptr;
  for (const Contender& c : plan.contenders) {
    if (!c.scene) continue;
    if (first == nullptr) first = &*c.scene;
    if (c.scene->spectrum.wavelengths_nm == first->spectrum.wavelengths_nm) continue;
    throw std::invalid_argument(fmt::format(
        "{}: key 'spectrum.wavelengths_nm': must be the same for all that are compared", c.label));
  }
}

}  // namespace

std::array<double, 2> ucs_chromaticity(const Tristimulus& xyz) {
  const double sum = xyz[0] + 15 * xyz[1] + 3 * xyz[2];
  return {4 * xyz[0] / sum, 9 * xyz[1] / sum};
}

ComparisonPlan plan_comparison(const ComparisonOptions& options) {
  ComparisonPlan plan;
  plan.options = options;
  if (options.contenders.size() < 2) {
    throw std::invalid_argument(
        "compare: needs two or more methods, models or EXR images; the first is the reference");
  }
  if (options.picture_size < 16 || options.picture_size > 1024) {
    throw std::invalid_argument(
        fmt::format("--picture-size {}: must be 16..1024 pixels", options.picture_size));
  }
  if (fs::exists(options.directory) && !fs::is_directory(options.directory)) {
    throw std::invalid_argument(
        fmt::format("-o {}: is a file: must be a folder", options.directory.string()));
  }
  for (const std::string& text : options.contenders) {
    Contender c;
    c.label = text;
    if (text.ends_with(".exr")) {
      c.image = image_of(options, text);
    } else {
      const std::vector<std::string> parts = parts_of(text);
      require_own_settings(text, parts);
      c.scene = scene_of(options, parts);
    }
    plan.contenders.push_back(std::move(c));
  }
  require_same_wavelengths(plan);
  place_sun(plan);
  return plan;
}

Comparison compare_skies(const ComparisonPlan& plan, const RunControl& control) {
  Comparison result;
  result.plan = plan;
  const Views views = views_of(plan);
  std::map<std::size_t, SolvedContender> solved;
  std::vector<std::optional<double>> suns(plan.suns_deg.begin(), plan.suns_deg.end());
  if (suns.empty()) suns.emplace_back();  // images that do not say
  for (const std::optional<double>& sun : suns) {
    std::optional<Look> reference;
    for (std::size_t c = 0; c < plan.contenders.size(); ++c) {
      const Contender& contender = plan.contenders[c];
      control.check();
      control.report(sun ? fmt::format("{}, Sun {} deg", contender.label, *sun) : contender.label,
                     static_cast<double>(result.rows.size()) /
                         static_cast<double>(suns.size() * plan.contenders.size()));
      ComparisonRow row;
      row.contender = c;
      row.sun_elevation_deg = sun;
      RunControl quiet;
      quiet.cancel = control.cancel;
      auto at = solved.find(c);
      if (contender.scene && at == solved.end()) {
        at = solved.try_emplace(c, *contender.scene).first;
      }
      try {
        const Look look = contender.image
                              ? look_at_image(*contender.image, views, plan, row)
                              : at->second.look(*sun * kRadPerDeg, views, plan, row, quiet);
        if (c == 0) reference = look;
        if (reference) row.errors = errors_of(look, *reference, views);
      } catch (const std::invalid_argument& error) {
        row.undefined = error.what();
      }
      result.rows.push_back(std::move(row));
    }
  }
  return result;
}

}  // namespace twilight
