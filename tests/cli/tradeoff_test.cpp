// The ladder of settings: its files, its laws, and what survives a kill.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

// Coarse enough for a rung to take a fraction of a second; light goes straight, so that the rung
// without refraction is one to skip.
constexpr const char* kScene = R"([sun]
elevation_deg = -2
[atmosphere]
refraction = false
refractive_spreading = false
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [550]
)";

const std::vector<std::string> kLadder = {"tradeoff",
                                          "scene.toml",
                                          "--quick",
                                          "--suns",
                                          "5,-4",
                                          "--set",
                                          "atmosphere.layers=10",
                                          "--set",
                                          "solver.azimuth_divisions=16",
                                          "--set",
                                          "solver.zenith_step_deg=3",
                                          "--set",
                                          "solver.altitude_levels=8",
                                          "--set",
                                          "solver.polar_directions=8",
                                          "--set",
                                          "solver.azimuth_directions=4"};
// A reference on the rungs' own grid, so that scattering orders are all that sets it apart.
const std::vector<std::string> kSameGrid = {"--reference-set",
                                            "solver.zenith_step_deg=3",
                                            "--reference-set",
                                            "solver.altitude_levels=8",
                                            "--reference-set",
                                            "solver.polar_directions=8",
                                            "--reference-set",
                                            "atmosphere.layers=10",
                                            "--reference-set",
                                            "atmosphere.top_km=100",
                                            "-o",
                                            "out"};
// Two rungs beside the reference.
const std::vector<std::string> kFewRungs = {"--only", "orders-events-*"};

using Row = std::map<std::string, std::string>;

std::vector<Row> rows_of(const std::string& csv) {
  const std::vector<std::string> lines = lines_of(csv);
  std::vector<Row> rows;
  const std::vector<std::string> columns = cells_of(lines.at(0));
  for (std::size_t i = 1; i < lines.size(); ++i) {
    // The column of settings is quoted where it holds a list of wavelengths.
    std::string line = lines[i];
    const std::size_t quote = line.find('"'), end = line.rfind('"');
    if (quote != std::string::npos) line.replace(quote, end - quote + 1, "quoted");
    const std::vector<std::string> cells = cells_of(line);
    EXPECT_EQ(cells.size(), columns.size()) << line;
    Row row;
    for (std::size_t c = 0; c < columns.size(); ++c) row[columns[c]] = cells.at(c);
    rows.push_back(row);
  }
  return rows;
}

// The columns that say what came out; the others say how long it took.
Row figures_of(const Row& row) {
  Row figures;
  for (const auto& [column, cell] : row) {
    const bool timed = column.find("seconds") != std::string::npos || column == "peak_mib" ||
                       column.starts_with("front_");
    if (!timed) figures[column] = cell;
  }
  return figures;
}

// Processes whose working folder this is: the program and its children.
int processes_in(const fs::path& folder) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    std::error_code hidden;
    if (fs::read_symlink(entry.path() / "cwd", hidden) == folder && !hidden) ++count;
  }
  return count;
}

void expect_no_process_within_two_seconds(const fs::path& folder) {
  for (int waited = 0; waited < 200 && processes_in(folder) > 0; ++waited)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(processes_in(folder), 0);
}

void expect_tables_plots_and_a_file_per_rung(const Workplace& place, const std::vector<Row>& rows) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(place.path("out")))
    names.insert(entry.path().filename().string());
  EXPECT_EQ(names, (std::set<std::string>{
                       "approximations.md", "front.md", "front.svg", "memory_radiance.svg",
                       "reference.json", "rungs", "seconds_ciede2000.svg", "seconds_luminance.svg",
                       "seconds_radiance.svg", "tradeoff.csv", "tradeoff.json"}));
  const auto manifest = nlohmann::json::parse(place.read("out/tradeoff.json"));
  EXPECT_EQ(manifest.at("program"), std::string("twilight ") + TWILIGHT_VERSION);
  EXPECT_GT(manifest.at("machine").at("cores").get<int>(), 0);
  std::set<std::string> done;
  for (const auto& rung : manifest.at("rungs")) {
    const std::string name = rung.at("name");
    if (rung.at("state") == "skipped") {
      EXPECT_NE(rung.at("reason").get<std::string>(), "") << name;
      EXPECT_FALSE(fs::exists(place.path("out/rungs/" + name + ".json")));
      continue;
    }
    EXPECT_EQ(rung.at("state"), "done") << name;
    EXPECT_TRUE(fs::exists(place.path("out/rungs/" + name + ".json"))) << name;
    EXPECT_GT(rung.at("seconds_all_suns").get<double>(), 0) << name;
    for (const auto& row : rung.at("rows")) {
      EXPECT_GT(row.at("seconds").get<double>(), 0) << name;
      EXPECT_GT(row.at("cpu_seconds").get<double>(), 0) << name;
      EXPECT_GT(row.at("peak_mib").get<double>(), 1) << name;
    }
    done.insert(name);
  }
  // Two Suns, and approximations once more against their own method.
  std::map<std::string, int> rows_by_rung;
  for (const Row& row : rows) {
    EXPECT_TRUE(done.contains(row.at("rung"))) << row.at("rung");
    if (row.at("baseline") == "reference") ++rows_by_rung[row.at("rung")];
  }
  EXPECT_EQ(rows_by_rung.size(), done.size());
  for (const auto& [name, count] : rows_by_rung) EXPECT_EQ(count, 2) << name;
  EXPECT_TRUE(done.contains("cells-all"));
  EXPECT_FALSE(done.contains("orders-no-refraction"));  // the scene has none
}

void expect_front_not_dominated_and_dominating(const std::vector<Row>& rows) {
  for (const std::string measure : {"radiance", "luminance", "ciede2000"}) {
    std::map<std::string, std::vector<Row>> by_sun;
    for (const Row& row : rows) {
      if (row.at("baseline") == "reference" && row.at(measure + "_mean") != "")
        by_sun[row.at("sun_elevation_deg")].push_back(row);
    }
    EXPECT_EQ(by_sun.size(), 2u);
    for (const auto& [sun, here] : by_sun) {
      const auto number = [](const Row& row, const std::string& column) {
        return std::stod(row.at(column));
      };
      for (const Row& a : here) {
        bool dominated = false, beaten_by_front = false;
        for (const Row& b : here) {
          const double dt = number(b, "seconds") - number(a, "seconds");
          const double de = number(b, measure + "_mean") - number(a, measure + "_mean");
          const bool beats = dt <= 0 && de <= 0 && (dt < 0 || de < 0);
          dominated = dominated || beats;
          beaten_by_front = beaten_by_front || (beats && b.at("front_" + measure) == "1");
        }
        const bool front = a.at("front_" + measure) == "1";
        EXPECT_EQ(front, !dominated) << a.at("rung") << ", Sun " << sun;
        EXPECT_NE(front, beaten_by_front) << a.at("rung") << ", Sun " << sun;
      }
    }
  }
}

// Each order adds light that is not negative, so what is missing can but shrink.
void expect_every_order_nearer(const std::vector<Row>& rows) {
  std::map<std::string, std::map<std::string, Row>> by_sun;
  for (const Row& row : rows) {
    if (row.at("baseline") == "reference")
      by_sun[row.at("sun_elevation_deg")][row.at("rung")] = row;
  }
  for (const auto& [sun, here] : by_sun) {
    const auto figure = [&, &rungs = here](const char* rung, const std::string& column) {
      return std::stod(rungs.at(rung).at(column));
    };
    for (const std::string column : {"radiance_mean", "luminance_mean", "ciede2000_mean"}) {
      EXPECT_GT(figure("orders-events-1", column), figure("orders-events-3", column)) << sun;
      EXPECT_GT(figure("orders-events-3", column), figure("orders", column)) << sun;
    }
    EXPECT_LT(figure("orders", "radiance_mean"), 0.003) << "the order tolerance";
    EXPECT_LT(figure("cells-events-1", "radiance_bias"), figure("cells", "radiance_bias"));
    // Single scattering is too dark everywhere: its bias is its error.
    const Row& single = here.at("orders-events-1");
    EXPECT_NEAR(std::stod(single.at("radiance_bias")), -std::stod(single.at("radiance_mean")),
                1e-12);
    for (const std::string measure : {"radiance", "luminance", "ciede2000"}) {
      EXPECT_LE(std::stod(single.at(measure + "_mean")), std::stod(single.at(measure + "_max")));
      EXPECT_LE(std::stod(single.at(measure + "_p95")), std::stod(single.at(measure + "_max")));
    }
  }
}

TEST(CliTradeoff, QuickLadderKeepsItsLaws) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const Finished finished = place.run(with(kLadder, kSameGrid));
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_EQ(finished.out, "");
  EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml", "out"}));
  const std::vector<Row> rows = rows_of(place.read("out/tradeoff.csv"));
  expect_tables_plots_and_a_file_per_rung(place, rows);
  expect_front_not_dominated_and_dominating(rows);
  expect_every_order_nearer(rows);
}

TEST(CliTradeoff, KilledRunGoesOnWhereItStopped) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const std::vector<std::string> command = with(with(kLadder, kFewRungs), kSameGrid);
  const Finished killed = place.run_and_signal(command, SIGKILL, "rung 3 of 3");
  EXPECT_EQ(killed.exit_code, -1);
  expect_no_process_within_two_seconds(place.path("").parent_path());
  EXPECT_FALSE(fs::exists(place.path("out/tradeoff.json")));
  const std::string first = place.read("out/rungs/orders-events-1.json");
  ASSERT_NE(first, "");

  const Finished resumed = place.run(command);
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_NE(resumed.err.find("1 run now, 2 kept"), std::string::npos) << resumed.err;
  EXPECT_EQ(place.read("out/rungs/orders-events-1.json"), first);
  // The same figures as a run that nothing disturbs.
  const auto figures = [&] {
    std::vector<Row> all;
    for (const Row& row : rows_of(place.read("out/tradeoff.csv"))) all.push_back(figures_of(row));
    return all;
  };
  const std::vector<Row> after_kill = figures();
  EXPECT_EQ(after_kill.size(), 4u);
  ASSERT_EQ(place.run(with(command, {"--fresh"})).exit_code, 0);
  EXPECT_EQ(figures(), after_kill);
}

TEST(CliTradeoff, InterruptEndsParentAndChildAndKeepsWhatIsDone) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const std::vector<std::string> command = with(with(kLadder, kFewRungs), kSameGrid);
  const Finished stopped = place.run_and_signal(command, SIGINT, "rung 2 of 3");
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  expect_no_process_within_two_seconds(place.path("").parent_path());
  EXPECT_TRUE(fs::exists(place.path("out/reference.json")));
  EXPECT_FALSE(fs::exists(place.path("out/tradeoff.csv")));
  // No half file.
  for (const auto& entry : fs::recursive_directory_iterator(place.path("out")))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
}

// Kills the first child that the program in this folder starts.
void kill_first_child_in(const fs::path& folder) {
  for (int waited = 0; waited < 6000; ++waited) {
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::error_code hidden;
      if (fs::read_symlink(entry.path() / "cwd", hidden) != folder || hidden) continue;
      std::ifstream stream(entry.path() / "cmdline");
      const std::string command{std::istreambuf_iterator<char>(stream), {}};
      if (command.find("tradeoff-rung") == std::string::npos) continue;
      ::kill(std::stoi(entry.path().filename().string()), SIGKILL);
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

TEST(CliTradeoff, CrashCostsOneRung) {
  const Workplace place;
  place.write("scene.toml", kScene);
  ASSERT_EQ(place.run(with(with(kLadder, kSameGrid), {"--only", "orders-events-1"})).exit_code, 0);

  std::thread killer(kill_first_child_in, place.path("").parent_path());
  const std::vector<std::string> command = with(with(kLadder, kFewRungs), kSameGrid);
  const Finished finished = place.run(command);
  killer.join();
  EXPECT_EQ(finished.exit_code, 1);
  EXPECT_NE(finished.err.find("rung orders-events-3 failed: its process was ended by signal 9"),
            std::string::npos)
      << finished.err;
  const auto manifest = nlohmann::json::parse(place.read("out/tradeoff.json"));
  for (const auto& rung : manifest.at("rungs")) {
    const std::string name = rung.at("name");
    const char* state = name == "orders-events-1"   ? "done"
                        : name == "orders-events-3" ? "failed"
                                                    : nullptr;
    if (state != nullptr) {
      EXPECT_EQ(rung.at("state"), state);
    }
  }
  EXPECT_EQ(rows_of(place.read("out/tradeoff.csv")).size(), 2u);

  const Finished again = place.run(command);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.err.find("1 run now, 2 kept"), std::string::npos) << again.err;
}

TEST(CliTradeoff, ChangedSceneRunsAgainAndAnEarlierReferenceServes) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const std::vector<std::string> one_rung = with(kLadder, {"--only", "orders-events-1"});
  const std::vector<std::string> command = with(one_rung, {"-o", "out"});
  const auto says = [](const Finished& finished, const char* words) {
    EXPECT_EQ(finished.exit_code, 0) << finished.err;
    EXPECT_NE(finished.err.find(words), std::string::npos) << finished.err;
  };
  says(place.run(command), "2 run now, 0 kept");
  says(place.run(command), "0 run now, 2 kept");
  // More repeats are another measurement of the same figures; the reference is not timed.
  says(place.run(with(command, {"--repeat", "2"})), "1 run now, 1 kept");
  // A damaged file counts as none.
  place.write("out/rungs/orders-events-1.json", "{");
  says(place.run(command), "1 run now, 1 kept");

  const std::vector<Row> before = rows_of(place.read("out/tradeoff.csv"));
  says(place.run(with(one_rung, {"-o", "other", "--reference", "out/reference.json"})),
       "1 run now, 1 kept");
  const std::vector<Row> after = rows_of(place.read("other/tradeoff.csv"));
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i)
    EXPECT_EQ(figures_of(after[i]), figures_of(before[i]));

  const std::vector<std::string> albedo = {"--set", "earth.ground_albedo=0.5"};
  expect_refused(place.run(with(with(command, albedo), {"--reference", "out/reference.json"})),
                 {"out/reference.json", "another scene"});
  says(place.run(with(command, albedo)), "2 run now, 0 kept");
}

TEST(CliTradeoffUsage, BadInputIsRefusedAndLeavesNothing) {
  const Workplace place;
  place.write("scene.toml", kScene);
  place.write("file", "");
  const std::set<std::string> before = place.names();
  const std::pair<std::vector<std::string>, std::vector<std::string>> cases[] = {
      {{"-o", "file"}, {"-o file", "folder"}},
      {{"-o", "out", "--suns", "5,91"}, {"--suns", "91", "-18..90"}},
      {{"-o", "out", "--suns", "5,x"}, {"--suns", "'x'", "-18..90"}},
      {{"-o", "out", "--suns", "5,5"}, {"--suns", "twice"}},
      {{"-o", "out", "--repeat", "0"}, {"--repeat 0", "1..100"}},
      {{"-o", "out", "--only", "no-such-rung"}, {"--only no-such-rung", "must match"}},
      {{"-o", "out", "--reference", "absent.json"}, {"absent.json", "cannot be read"}},
      {{"-o", "out", "--reference", "scene.toml"}, {"scene.toml", "no sampled sky"}},
      {{"-o", "out", "--set", "atmosphere.layers=0"}, {"'atmosphere.layers'", "1..500"}},
      {{"-o", "out", "--reference-set", "solver.threads=-1"}, {"'solver.threads'", "0..1024"}},
  };
  for (const auto& [arguments, fragments] : cases) {
    expect_refused(place.run(with({"tradeoff", "scene.toml", "--quick"}, arguments)), fragments);
    EXPECT_EQ(place.names(), before);
  }
  const Finished nowhere = place.run({"tradeoff", "scene.toml"});
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_NE(nowhere.err.find("--output"), std::string::npos) << nowhere.err;
  // The hidden half of the command is not offered.
  EXPECT_EQ(place.run({"--help"}).out.find("tradeoff-rung"), std::string::npos);
}

}  // namespace
}  // namespace twilight
