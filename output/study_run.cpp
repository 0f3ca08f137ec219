#include "output/study_run.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "output/atomic_file.h"
#include "output/checksum.h"
#include "output/exr_image.h"
#include "output/preview.h"
#include "output/study_case_file.h"
#include "output/study_manifest.h"
#include "output/twilight_duration.h"
#include "sim/scene_model.h"
#include "sim/solver_arena.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// A case computed: its result and pictures, or what went wrong.
struct Computed {
  CaseResult result;
  std::optional<SkyImage> picture, exr;
  std::string error;
};

class StudyRunner {
 public:
  StudyRunner(const StudyPlan& plan, const fs::path& directory, bool fresh,
              const RunControl& control)
      : plan_(plan), folder_(cases_folder(directory)), fresh_(fresh), control_(control) {
    quiet_.cancel = control.cancel;
  }

  StudyOutcome run(std::span<const std::size_t> cases,
                   const std::function<void(const StudyProgress&)>& after_group);

 private:
  void run_group(const CaseGroup& group, const std::vector<std::size_t>& pending);
  void run_shared(const std::vector<std::size_t>& pending);
  SceneModel model_of(std::size_t node);
  template <class MakeSky>
  void run_case(std::size_t node, MakeSky make_sky);
  KnownTwilight* known_twilight(const SceneModel& model);
  Computed compute(const SceneModel& model, const Sky& sky);
  void keep(std::size_t node, const Computed& computed);
  void keep_error(std::size_t node, const std::string& error);

  const StudyPlan& plan_;
  const fs::path folder_;
  const bool fresh_;
  const RunControl& control_;
  RunControl quiet_;  // solvers' stages come again with every group
  std::string particles_;
  KnownPhases phases_;
  std::mutex serial_;  // of the netCDF library, which inputs may be read with, and of phases_
  // Of the air of the group that is computed, by the observer's height; empty: cases share none.
  std::map<double, KnownTwilight> twilight_;
  bool shares_ = false;
  StudyOutcome outcome_;
  Clock::time_point start_ = Clock::now();
};

// Of what may go wrong with one case, as text; what is wrong with the whole run goes through.
template <class Action>
std::string error_of(Action action) {
  try {
    action();
    return {};
  } catch (const Cancelled&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    const std::string what = error.what();
    return what.empty() ? "unknown error" : what;
  }
}

SceneModel StudyRunner::model_of(std::size_t node) {
  const std::lock_guard lock(serial_);
  // Waiting for its own tasks, a thread must not take up a case that waits for the lock.
  return tbb::this_task_arena::isolate(
      [&] { return build_scene_model(plan_.study.scene_at(node).scene, &phases_); });
}

KnownTwilight* StudyRunner::known_twilight(const SceneModel& model) {
  if (!shares_) return nullptr;
  const std::lock_guard lock(serial_);
  return &twilight_[model.scene.observer.height_m];
}

Computed StudyRunner::compute(const SceneModel& model, const Sky& sky) {
  Computed computed;
  CaseResult& result = computed.result;
  result.quantities = observe(sky, model, plan_.wanted, quiet_, known_twilight(model));
  computed.picture = case_picture(sky, model, plan_.wanted, quiet_);
  computed.exr = case_exr(sky, model, plan_.wanted, quiet_);
  for (StudyQuantity& q : result.quantities) {
    for (double& value : q.values) {
      // One NaN for all: a file's bytes shall not tell how it came about.
      if (std::isnan(value)) value = std::numeric_limits<double>::quiet_NaN();
      if (std::isinf(value)) throw std::runtime_error(q.name + " is not finite");
    }
  }
  {
    const std::lock_guard lock(serial_);  // it reads mixtures and what they name
    tbb::this_task_arena::isolate([&] { result.inputs = case_inputs(model.scene, plan_.wanted); });
  }
  for (const auto& [key, what] : sky.summary().clamps) {
    result.clamps += fmt::format("{}{} = {}", result.clamps.empty() ? "" : "; ", key, what);
  }
  return computed;
}

void StudyRunner::keep(std::size_t node, const Computed& computed) {
  const std::string& hash = plan_.cases[node].hash;
  CaseResult result = computed.result;
  result.hash = hash;
  if (fnv1a128(result.inputs) != hash) {
    throw std::runtime_error(fmt::format(
        "{}: a file that the scene names changed while the study ran", plan_.study.file.string()));
  }
  if (computed.picture) {
    const fs::path picture = case_picture_file(folder_, hash);
    result.picture = picture.filename().string();
    AtomicFile file(picture);
    write_preview_png(file, *computed.picture);
    file.commit();
  }
  if (computed.exr) {
    const fs::path exr = case_exr_file(folder_, hash);
    result.exr = exr.filename().string();
    write_exr(exr, *computed.exr, computed.exr->projection.value(), {{"studyCase", hash}});
  }
  const std::lock_guard lock(serial_);
  write_case(folder_, result, plan_.coordinates);
  std::error_code ignored;
  fs::remove(case_error_file(folder_, hash), ignored);
  ++outcome_.progress.done;
  control_.report("cases", 1 - static_cast<double>(outcome_.progress.left()) /
                                   static_cast<double>(outcome_.progress.cases));
}

void StudyRunner::keep_error(std::size_t node, const std::string& error) {
  const std::lock_guard lock(serial_);
  write_text_file(case_error_file(folder_, plan_.cases[node].hash), error + "\n");
  ++outcome_.progress.failed;
}

template <class MakeSky>
void StudyRunner::run_case(std::size_t node, MakeSky make_sky) {
  Computed computed;
  const std::string error = error_of([&] {
    const SceneModel model = model_of(node);
    const std::unique_ptr<Sky> sky = make_sky(model);
    computed = compute(model, *sky);
  });
  if (error.empty()) {
    keep(node, computed);
  } else {
    keep_error(node, error);
  }
}

// The atmosphere is the first pending case's: those of the others are the same to the bit.
void StudyRunner::run_shared(const std::vector<std::size_t>& pending) {
  std::shared_ptr<const OrdersAtmosphere> atmosphere;
  int threads = 0;
  const std::string error = error_of([&] {
    const SceneModel model = model_of(pending.front());
    threads = model.scene.solver.threads;
    ++outcome_.solves;
    atmosphere = solve_atmosphere(model, quiet_);
  });
  if (!error.empty()) {
    for (const std::size_t node : pending) keep_error(node, error);
    return;
  }
  twilight_.clear();
  SolverArena arena(threads);
  arena.arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, pending.size(), [&](std::size_t k) {
      quiet_.check();
      run_case(pending[k], [&](const SceneModel& model) {
        return sky_in_atmosphere(model, atmosphere, quiet_);
      });
    });
  });
}

void StudyRunner::run_group(const CaseGroup& group, const std::vector<std::size_t>& pending) {
  // Other particles may share components with these; but memory shall not grow with the study.
  constexpr std::size_t kMostMatrices = 600;
  if (group.particles != particles_ && phases_.size() > kMostMatrices) phases_ = KnownPhases();
  particles_ = group.particles;
  shares_ = group.shares;
  if (group.shares) return run_shared(pending);
  for (const std::size_t node : pending) {
    run_case(node, [&](const SceneModel& model) {
      ++outcome_.solves;
      return solve_sky(model, quiet_);
    });
  }
}

StudyOutcome StudyRunner::run(std::span<const std::size_t> cases,
                              const std::function<void(const StudyProgress&)>& after_group) {
  std::map<std::size_t, std::vector<std::size_t>> pending;
  StudyProgress& progress = outcome_.progress;
  progress.cases = cases.size();
  for (const std::size_t node : cases) {
    control_.check();
    if (!fresh_ && read_case(folder_, plan_.cases[node].hash)) {
      ++progress.kept;
    } else {
      pending[plan_.cases[node].group].push_back(node);
    }
  }
  for (const auto& [group, nodes] : pending) {
    control_.check();
    run_group(plan_.groups[group], nodes);
    progress.seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    if (after_group) after_group(progress);
  }
  return outcome_;
}

}  // namespace

double StudyProgress::seconds_left() const {
  const std::size_t tried = done + failed;
  return tried == 0 ? 0.0 : seconds / static_cast<double>(tried) * static_cast<double>(left());
}

StudyOutcome run_study(const StudyPlan& plan, const fs::path& directory,
                       std::span<const std::size_t> cases, bool fresh, const RunControl& control,
                       const std::function<void(const StudyProgress&)>& after_group) {
  const fs::path folder = cases_folder(directory);
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder)) {
    throw std::runtime_error(fmt::format("cannot make the folder {}: {}", folder.string(),
                                         error ? error.message() : "it is a file"));
  }
  clean_study_folder(directory);
  write_manifest(directory, plan);
  return StudyRunner(plan, directory, fresh, control).run(cases, after_group);
}

}  // namespace twilight
