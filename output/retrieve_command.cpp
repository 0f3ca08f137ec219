#include "output/retrieve_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iostream>
#include <stdexcept>

#include "output/air_retrieval.h"
#include "output/atomic_file.h"
#include "output/retrieval_report.h"

namespace twilight {

void retrieve_air(Run& run, const LoadedScene& scene) {
  const RetrieveOptions& options = run.line.retrieve;
  const RetrievalPlan plan = checking_input([&] {
    RetrievalPlan made = plan_retrieval(scene, options);
    std::filesystem::create_directories(options.directory);
    AtomicFile probe(options.directory / "retrieval.json");
    return made;
  });
  const Retrieval retrieval =
      run.timed("retrieval", [&] { return run_retrieval(plan, run.control()); });
  run.control().check();
  const std::vector<std::string> files = write_retrieval(plan, retrieval);
  run.progress.clear();
  parameter_table(retrieval).write("-", std::cout);
  auto figures = retrieval_figures(plan, retrieval);
  figures.emplace_back("solutions in the search", fmt::format("{}", retrieval.evaluations));
  figures.emplace_back("written to " + options.directory.string(),
                       fmt::format("{}", fmt::join(files, ", ")));
  run.summarise({}, figures);
  if (retrieval.converged) return;
  throw std::runtime_error(fmt::format("the search did not converge: {}; {} says so",
                                       retrieval.starts[retrieval.best_start].termination,
                                       (options.directory / "retrieval.json").string()));
}

}  // namespace twilight
