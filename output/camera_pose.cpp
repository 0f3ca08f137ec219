#include "output/camera_pose.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRadPerDeg = pi / 180.0;
constexpr double kNarrowest = 3 * kRadPerDeg, kWidest = 160 * kRadPerDeg;

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

// East, north, up.
Vector3<double> unit_vector(MapDirection d) {
  const double c = std::cos(d.elevation_rad);
  return {c * std::sin(d.azimuth_rad), c * std::cos(d.azimuth_rad), std::sin(d.elevation_rad)};
}

template <class T>
struct Axes {
  Vector3<T> forward, right, up;
};

// A camera turned clockwise has its right side lowered.
template <class T>
Axes<T> axes_of(const T& azimuth, const T& elevation, const T& roll) {
  using std::cos, std::sin;
  const T ce = cos(elevation), se = sin(elevation), ca = cos(azimuth), sa = sin(azimuth);
  const Vector3<T> level_right(ca, -sa, T(0)), level_up(-se * sa, -se * ca, ce);
  const T cr = cos(roll), sr = sin(roll);
  return {Vector3<T>(ce * sa, ce * ca, se), cr * level_right - sr * level_up,
          sr * level_right + cr * level_up};
}

// Half the picture's height at unit distance is tan(fov / 2).
Vector3<double> camera_ray(double field_of_view, int width, int height, MapPosition p) {
  const double scale = 2 * std::tan(0.5 * field_of_view) / height;
  return Vector3<double>(1.0, (p.x - 0.5 * width) * scale, (0.5 * height - p.y) * scale)
      .normalized();
}

CameraPose pose_of(const Eigen::Matrix3d& axes, double field_of_view) {
  const Vector3<double> forward = axes.col(0), right = axes.col(1), up = axes.col(2);
  CameraPose pose;
  pose.elevation_rad = std::asin(std::clamp(forward.z(), -1.0, 1.0));
  pose.azimuth_rad = std::atan2(forward.x(), forward.y());
  // right.z = -sin(roll) cos(elevation), up.z = cos(roll) cos(elevation).
  pose.roll_rad = std::atan2(-right.z(), up.z());
  pose.field_of_view_rad = field_of_view;
  return pose;
}

// The rotation that brings the rays onto the stars best, and the rms angle that it leaves.
std::pair<CameraPose, double> best_rotation(std::span<const StarPlace> stars, int width, int height,
                                            double field_of_view) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const StarPlace& s : stars) {
    sum +=
        unit_vector(s.direction) * camera_ray(field_of_view, width, height, s.position).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // Forward, right, up is a left-handed system in east, north, up: of determinant -1.
  Eigen::Matrix3d keep = Eigen::Matrix3d::Identity();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() > 0) keep(2, 2) = -1;
  const Eigen::Matrix3d axes = svd.matrixU() * keep * svd.matrixV().transpose();
  double squares = 0;
  for (const StarPlace& s : stars) {
    squares +=
        (axes * camera_ray(field_of_view, width, height, s.position) - unit_vector(s.direction))
            .squaredNorm();
  }
  return {pose_of(axes, field_of_view), std::sqrt(squares / static_cast<double>(stars.size()))};
}

/// Distance on the picture of a star from its place, in pixels.
struct StarResidual {
  StarPlace star;
  double width, height;

  template <class T>
  bool operator()(const T* p, T* residual) const {
    using std::tan;
    const Axes<T> axes = axes_of(p[0], p[1], p[2]);
    const Vector3<T> d = unit_vector(star.direction).cast<T>();
    const T forward = d.dot(axes.forward);
    if (!(forward > T(1e-6))) return false;
    const T scale = height / (T(2) * tan(p[3] / T(2)));
    residual[0] = 0.5 * width + scale * d.dot(axes.right) / forward - star.position.x;
    residual[1] = 0.5 * height - scale * d.dot(axes.up) / forward - star.position.y;
    return true;
  }
};

}  // namespace

MapDirection direction_at(const CameraPose& pose, int width, int height, MapPosition position) {
  const Axes<double> axes = axes_of(pose.azimuth_rad, pose.elevation_rad, pose.roll_rad);
  const Vector3<double> ray = camera_ray(pose.field_of_view_rad, width, height, position);
  const Vector3<double> d = ray.x() * axes.forward + ray.y() * axes.right + ray.z() * axes.up;
  const double azimuth = std::atan2(d.x(), d.y());
  return {std::atan2(d.z(), std::hypot(d.x(), d.y())), azimuth < 0 ? azimuth + 2 * pi : azimuth};
}

std::optional<MapPosition> position_of(const CameraPose& pose, int width, int height,
                                       MapDirection direction) {
  const Axes<double> axes = axes_of(pose.azimuth_rad, pose.elevation_rad, pose.roll_rad);
  const Vector3<double> d = unit_vector(direction);
  const double forward = d.dot(axes.forward);
  if (!(forward > 0)) return std::nullopt;
  const double scale = height / (2 * std::tan(0.5 * pose.field_of_view_rad));
  return MapPosition{0.5 * width + scale * d.dot(axes.right) / forward,
                     0.5 * height - scale * d.dot(axes.up) / forward};
}

FittedPose fit_pose(std::span<const StarPlace> stars, int width, int height) {
  if (stars.size() < 2) throw std::invalid_argument("a pose needs two stars or more");
  for (std::size_t i = 1; i < stars.size(); ++i) {
    const double apart = std::hypot(stars[i].position.x - stars[0].position.x,
                                    stars[i].position.y - stars[0].position.y);
    if (apart < 1.0) throw std::invalid_argument("stars of a pose must stand in different places");
  }
  FittedPose fitted;
  double least = std::numeric_limits<double>::infinity();
  constexpr int kSteps = 120;
  for (int k = 0; k <= kSteps; ++k) {
    // Even in the tangent's logarithm: a focal length's steps.
    const double low = std::tan(0.5 * kNarrowest), high = std::tan(0.5 * kWidest);
    const double field = 2 * std::atan(low * std::pow(high / low, static_cast<double>(k) / kSteps));
    const auto [pose, rms] = best_rotation(stars, width, height, field);
    if (rms >= least) continue;
    least = rms;
    fitted.pose = pose;
  }
  double p[4] = {fitted.pose.azimuth_rad, fitted.pose.elevation_rad, fitted.pose.roll_rad,
                 fitted.pose.field_of_view_rad};
  ceres::Problem problem;
  for (const StarPlace& star : stars) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<StarResidual, 2, 4>(new StarResidual{
                                 star, static_cast<double>(width), static_cast<double>(height)}),
                             nullptr, p);
  }
  problem.SetParameterLowerBound(p, 3, kNarrowest);
  problem.SetParameterUpperBound(p, 3, kWidest);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  const double turn = std::fmod(p[0], 2 * pi);
  fitted.pose = {turn < 0 ? turn + 2 * pi : turn, p[1], p[2], p[3]};
  double squares = 0;
  for (const StarPlace& star : stars) {
    const auto seen = position_of(fitted.pose, width, height, star.direction);
    if (!seen) throw std::invalid_argument("the stars fit no camera: one would be behind it");
    fitted.residual_pixels.push_back(
        std::hypot(seen->x - star.position.x, seen->y - star.position.y));
    squares += fitted.residual_pixels.back() * fitted.residual_pixels.back();
  }
  fitted.rms_pixels = std::sqrt(squares / static_cast<double>(stars.size()));
  return fitted;
}

}  // namespace twilight
