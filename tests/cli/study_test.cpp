// twilight study: folders of cases that survive kills, shards, failures and full discs.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = R"([atmosphere]
layers = 10
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [450, 600]
[solver]
method = "orders"
zenith_step_deg = 3
altitude_levels = 8
polar_directions = 8
azimuth_directions = 4
scattering_orders = 2
sunlight_nodes = 64
view_interpolation = false
[preetham]
turbidity = 3
[outputs]
quantities = ["texture", "radiance"]
views = [[90, 0]]
texture_size = 8
picture_size = 16
)";

std::string axis(const std::string& key, const std::string& values) {
  return "[[axis]]\nkey = \"" + key + "\"\nvalues = " + values + "\n";
}

// 3 atmospheres, 9 cases.
std::string nine() {
  return kScene + axis("earth.ground_albedo", "[0.1, 0.3, 0.5]") +
         axis("sun.elevation_deg", "[9, 0, -4]");
}

const std::vector<std::string> kStudy = {"study", "study.toml", "-o", "out"};

/// Every file below a folder of the workplace with its bytes.
std::map<std::string, std::string> files_in(const Workplace& place, const std::string& folder) {
  std::map<std::string, std::string> files;
  const fs::path root = place.path(folder);
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), root).string();
    files[name] = place.read(folder + "/" + name);
  }
  return files;
}

void expect_same(const std::map<std::string, std::string>& a,
                 const std::map<std::string, std::string>& b) {
  for (const auto& [name, bytes] : a) {
    const auto other = b.find(name);
    ASSERT_NE(other, b.end()) << name << " is in the first alone";
    EXPECT_TRUE(other->second == bytes) << name << " differs";
  }
  for (const auto& [name, bytes] : b) EXPECT_TRUE(a.contains(name)) << name;
}

std::vector<std::string> case_files(const Workplace& place, const std::string& extension) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(place.path("out/cases"))) {
    if (entry.path().extension() == extension) names.push_back(entry.path().filename());
  }
  return names;
}

TEST(CliStudy, MakesFilesOfEveryCaseAndOfAll) {
  const Workplace place;
  place.write("study.toml", nine());
  const Finished run = place.run(kStudy);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "");
  EXPECT_NE(run.err.find("9 cases, 3 atmospheres to solve (6 solves saved)"), std::string::npos)
      << run.err;
  EXPECT_EQ(case_files(place, ".nc").size(), 9u);
  EXPECT_EQ(case_files(place, ".png").size(), 9u);
  const std::vector<std::string> table = lines_of(place.read("out/study.csv"));
  ASSERT_EQ(table.size(), 10u);
  EXPECT_TRUE(table[0].starts_with("case,earth.ground_albedo,sun.elevation_deg,")) << table[0];
  EXPECT_TRUE(table[6].starts_with("6,0.3,-4,")) << table[6];
  for (const char* name : {"study.nc", "study.json", "index.html"}) {
    EXPECT_TRUE(fs::is_regular_file(place.path(std::string("out/") + name))) << name;
  }
  // More light is reflected back from brighter ground.
  const auto number = [&](std::size_t row) { return std::stod(cells_of(table[row])[4]); };
  EXPECT_LT(number(1), number(4));
}

TEST(CliStudy, ThreadsDoNotChangeAByte) {
  const Workplace place;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run(with(kStudy, {"--threads", "1", "--quiet"})).exit_code, 0);
  ASSERT_EQ(place.run({"study", "study.toml", "-o", "two", "--threads", "2", "--quiet"}).exit_code,
            0);
  expect_same(files_in(place, "out"), files_in(place, "two"));
}

TEST(CliStudy, KilledAtAnyMomentItGoesOnToTheSameBytes) {
  const Workplace place;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run({"study", "study.toml", "-o", "whole", "--quiet"}).exit_code, 0);
  // Moments of the first runs: the plan, the first solves, cases in between, the end.
  // Near the end the program may be quicker than the signal.
  int killed = 0;
  for (const char* said :
       {"atmospheres to solve", "cases ...", "3 of 9 cases", "6 of 9 cases", "putting together"}) {
    if (place.run_and_signal(kStudy, SIGKILL, said).exit_code == -1) ++killed;
  }
  EXPECT_GE(killed, 2);
  // What a killed run may leave: files of a process that is no more. Those of living ones stay.
  const pid_t dead = ::fork();
  if (dead == 0) ::_exit(0);
  ::waitpid(dead, nullptr, 0);
  fs::create_directories(place.path("out/plots"));
  for (const char* folder : {"out/", "out/cases/", "out/plots/"}) {
    place.write(folder + (".a.tmp-" + std::to_string(dead)) + "-0.nc", "half");
  }
  const Finished resumed = place.run(kStudy);
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  expect_same(files_in(place, "whole"), files_in(place, "out"));
}

TEST(CliStudy, ALivingProcessKeepsItsTemporaryFiles) {
  const Workplace place;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run(with(kStudy, {"--case", "1", "--quiet"})).exit_code, 0);
  const std::string own = "out/cases/.a.tmp-" + std::to_string(::getpid()) + "-0.nc";
  place.write(own, "half");
  ASSERT_EQ(place.run(with(kStudy, {"--case", "1", "--quiet"})).exit_code, 0);
  EXPECT_EQ(place.read(own), "half");
}

TEST(CliStudy, StoppedItKeepsWhatIsDone) {
  const Workplace place;
  place.write("study.toml", nine());
  const Finished stopped = place.run_and_signal(kStudy, SIGINT, "3 of 9 cases");
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_NE(stopped.err.find("cases that are done are kept"), std::string::npos) << stopped.err;
  EXPECT_FALSE(fs::exists(place.path("out/study.nc")));
  EXPECT_GE(case_files(place, ".nc").size(), 3u);
  const Finished resumed = place.run(kStudy);
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(resumed.err.find(" 0 kept"), std::string::npos) << resumed.err;
}

TEST(CliStudy, ShardsMergedAreTheSingleRun) {
  const Workplace place;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run(with(kStudy, {"--quiet"})).exit_code, 0);
  // Two shards into one folder, the third into another; then a case by its number.
  for (const auto& [shard, folder] :
       std::vector<std::pair<std::string, std::string>>{{"1/3", "a"}, {"3/3", "a"}, {"2/3", "b"}}) {
    const Finished run = place.run({"study", "study.toml", "-o", folder, "--shard", shard});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_NE(run.err.find("cases: 3 computed, 0 kept, 0 failed; 1 solves"), std::string::npos)
        << run.err;
  }
  EXPECT_FALSE(fs::exists(place.path("a/study.nc")));
  const Finished early = place.run({"study", "--merge", "a"});
  EXPECT_EQ(early.exit_code, 1);
  EXPECT_NE(early.err.find("3 of 9 cases are missing, the first of them case 4"), std::string::npos)
      << early.err;
  EXPECT_FALSE(fs::exists(place.path("a/study.nc")));
  const Finished merged = place.run({"study", "--merge", "a", "b"});
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  expect_same(files_in(place, "out"), files_in(place, "a"));
  // And into a folder of its own.
  ASSERT_EQ(place.run({"study", "--merge", "b", "a", "-o", "c", "--quiet"}).exit_code, 0);
  expect_same(files_in(place, "out"), files_in(place, "c"));
}

TEST(CliStudy, OneCaseAloneIsTheOneOfTheWhole) {
  const Workplace place;
  place.write("study.toml", nine());
  const Finished listed = place.run({"study", "study.toml", "--list", "--quiet"});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  const std::vector<std::string> rows = lines_of(listed.out);
  ASSERT_EQ(rows.size(), 10u);
  EXPECT_EQ(rows[0], "case,atmosphere,earth.ground_albedo,sun.elevation_deg,hash");
  const std::string hash = cells_of(rows[5])[4];
  ASSERT_EQ(place.run({"study", "study.toml", "-o", "one", "--case", "5", "--quiet"}).exit_code, 0);
  ASSERT_EQ(place.run(with(kStudy, {"--quiet"})).exit_code, 0);
  EXPECT_EQ(place.read("one/cases/" + hash + ".nc"), place.read("out/cases/" + hash + ".nc"));
  expect_refused(place.run({"study", "study.toml", "-o", "one", "--case", "10"}),
                 {"--case 10: must be 1..9"});
  expect_refused(place.run({"study", "study.toml", "-o", "one", "--shard", "4/3"}),
                 {"--shard 4/3: must be I/N"});
}

TEST(CliStudy, AnExrOfEveryCaseIsPartOfIt) {
  const Workplace place;
  place.write("study.toml", kScene + std::string("exr_size = 8\n") +
                                axis("earth.ground_albedo", "[0.1, 0.3]") +
                                "[sun]\nelevation_deg = 3\n");
  ASSERT_EQ(place.run(with(kStudy, {"--quiet"})).exit_code, 0);
  const std::vector<std::string> images = case_files(place, ".exr");
  ASSERT_EQ(images.size(), 2u);
  const auto before = files_in(place, "out");
  ASSERT_EQ(place.run({"study", "--merge", "out", "-o", "copy", "--quiet"}).exit_code, 0);
  expect_same(before, files_in(place, "copy"));
  fs::remove(place.path("out/cases/" + images[0]));
  const Finished healed = place.run(kStudy);
  EXPECT_NE(healed.err.find("1 computed, 1 kept"), std::string::npos) << healed.err;
  expect_same(before, files_in(place, "out"));
}

TEST(CliStudy, AChangeComputesOnlyWhatItTouches) {
  const Workplace place;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run(with(kStudy, {"--quiet"})).exit_code, 0);
  place.write("study.toml", kScene + axis("earth.ground_albedo", "[0.1, 0.3, 0.5]") +
                                axis("sun.elevation_deg", "[9, 4, 0, -4]"));
  const Finished more = place.run(kStudy);
  ASSERT_EQ(more.exit_code, 0) << more.err;
  EXPECT_NE(more.err.find("3 computed, 9 kept, 0 failed; 3 solves"), std::string::npos) << more.err;
  const Finished again = place.run(kStudy);
  EXPECT_NE(again.err.find("0 computed, 12 kept, 0 failed; 0 solves"), std::string::npos)
      << again.err;
  // A damaged case is computed again.
  const auto before = files_in(place, "out");
  const std::string victim = "out/cases/" + case_files(place, ".nc").front();
  std::string bytes = place.read(victim);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  place.write(victim, bytes);
  const Finished healed = place.run(kStudy);
  EXPECT_NE(healed.err.find("1 computed, 11 kept"), std::string::npos) << healed.err;
  expect_same(before, files_in(place, "out"));
}

// A part of a changed study must not leave the old one's numbers beside its own cases.
TEST(CliStudy, NumbersOfAnotherStudyGo) {
  const Workplace place;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run(with(kStudy, {"--quiet"})).exit_code, 0);
  ASSERT_TRUE(std::filesystem::exists(place.path("out/study.nc")));
  ASSERT_EQ(place.run(with(kStudy, {"--quiet", "--case", "1"})).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(place.path("out/study.nc")));
  place.write("study.toml", kScene + axis("sun.elevation_deg", "[9, 3]"));
  ASSERT_EQ(place.run(with(kStudy, {"--quiet", "--case", "1"})).exit_code, 0);
  for (const char* name : {"out/study.nc", "out/study.csv", "out/index.html"}) {
    EXPECT_FALSE(std::filesystem::exists(place.path(name))) << name;
  }
}

// Preetham's model ends at the horizon: those cases fail, the others do not care.
TEST(CliStudy, AFailedCaseIsRecordedAndTheOthersGoOn) {
  const Workplace place;
  place.write("study.toml", kScene + axis("solver.method", "[\"preetham\", \"orders\"]") +
                                axis("sun.elevation_deg", "[9, -40]"));
  const Finished run = place.run(kStudy);
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_NE(run.err.find("1 of 4 cases failed"), std::string::npos) << run.err;
  EXPECT_EQ(case_files(place, ".nc").size(), 3u);
  const std::vector<std::string> errors = case_files(place, ".error");
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(place.read("out/cases/" + errors[0]).find("sun.elevation_deg"), std::string::npos);
  const std::vector<std::string> table = lines_of(place.read("out/study.csv"));
  ASSERT_EQ(table.size(), 5u);
  EXPECT_TRUE(table[2].starts_with("2,preetham,-40,,,")) << table[2];
  EXPECT_NE(table[2].find("sun.elevation_deg"), std::string::npos) << table[2];
  EXPECT_TRUE(table[3].ends_with(",")) << table[3];
  // A rerun tries it again, and it alone.
  const Finished again = place.run(kStudy);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("0 computed, 3 kept, 1 failed"), std::string::npos) << again.err;
}

TEST(CliStudy, AFileWhereTheFolderShouldBeIsAClearError) {
  const Workplace place;
  place.write("study.toml", nine());
  place.write("out", "in the way");
  const Finished run = place.run(kStudy);
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("cannot make the folder out/cases"), std::string::npos) << run.err;
  EXPECT_EQ(place.read("out"), "in the way");
}

TEST(CliStudy, AReadOnlyFolderIsAClearErrorThatLosesNothing) {
  const Workplace place;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run({"study", "study.toml", "-o", "out", "--case", "1"}).exit_code, 0);
  const auto before = files_in(place, "out");
  const auto allow = [&](fs::perms perms) {
    for (const char* folder : {"out", "out/cases"}) fs::permissions(place.path(folder), perms);
  };
  // Root may write everywhere: then somebody else tries.
  fs::permissions(place.path(""), fs::perms(0755));
  std::string program = std::string("'") + TWILIGHT_PROGRAM + "'";
  if (::geteuid() == 0) {
    const std::string other = "setpriv --reuid=65534 --regid=65534 --clear-groups ";
    if (std::system((other + program + " --version > /dev/null 2>&1").c_str()) != 0) {
      GTEST_SKIP() << "root, and nobody else may run the program";
    }
    program = other + program;
  }
  allow(fs::perms(0555));
  const std::string said = place.path("said").string();
  const int status = std::system(("cd '" + place.path("").string() + "' && " + program +
                                  " study study.toml -o out > '" + said + "' 2>&1")
                                     .c_str());
  allow(fs::perms(0755));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_NE(place.read("said").find("twilight: cannot write out/"), std::string::npos)
      << place.read("said");
  EXPECT_NE(place.read("said").find("Permission denied"), std::string::npos) << place.read("said");
  expect_same(before, files_in(place, "out"));
  EXPECT_EQ(place.run(kStudy).exit_code, 0);
}

// A limit of the file size stands for a full disc: writes fail in the same way.
TEST(CliStudy, AFullDiscIsAClearErrorThatLosesNothing) {
  const Workplace place;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run({"study", "study.toml", "-o", "whole", "--quiet"}).exit_code, 0);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto size = fs::file_size(place.path("whole/study.nc"));
  for (const rlim_t bytes : {rlim_t{3000}, static_cast<rlim_t>(size - 100)}) {
    const rlimit full{bytes, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
    const Finished run = place.run(kStudy);
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_EQ(run.exit_code, 1) << run.err;
    EXPECT_NE(run.err.find("cannot write out/"), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(place.path("out/study.nc")));
  }
  EXPECT_EQ(case_files(place, ".nc").size(), 9u);
  const Finished resumed = place.run(kStudy);
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_NE(resumed.err.find("0 computed, 9 kept"), std::string::npos) << resumed.err;
  expect_same(files_in(place, "whole"), files_in(place, "out"));
}

TEST(CliStudy, TwoProcessesOnOneFolderDoNotDisturbEachOther) {
  const Workplace place, streams;
  place.write("study.toml", nine());
  ASSERT_EQ(place.run({"study", "study.toml", "-o", "whole", "--quiet"}).exit_code, 0);
  const std::string program = "cd '" + place.path("").string() + "' && '" + TWILIGHT_PROGRAM +
                              "' study study.toml -o out --quiet";
  EXPECT_EQ(std::system((program + " & " + program + "; a=$?; wait $!; exit $((a + $?))").c_str()),
            0);
  expect_same(files_in(place, "whole"), files_in(place, "out"));
}

TEST(CliStudy, ASlurmArrayRunsItsShards) {
  const Workplace place;
  place.write("study.toml", nine());
  const Finished run = place.run(with(kStudy, {"--slurm", "2", "--set", "atmosphere.layers=9"}));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string script = place.read("out/study.sbatch");
  for (const char* line : {"#!/bin/bash\n", "#SBATCH --array=1-2\n",
                           "#SBATCH --cpus-per-task=", "#SBATCH --mem=", "#SBATCH --time=0:10:00\n",
                           "--set 'atmosphere.layers=9'"}) {
    EXPECT_NE(script.find(line), std::string::npos) << line << "\n" << script;
  }
  for (const char* task : {"1", "2"}) {
    const std::string command = std::string("SLURM_ARRAY_TASK_ID=") + task +
                                " SLURM_CPUS_PER_TASK=2 bash '" +
                                place.path("out/study.sbatch").string() + "' 2>/dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0);
  }
  EXPECT_EQ(place.run({"study", "--merge", "out", "--quiet"}).exit_code, 0);
  EXPECT_EQ(lines_of(place.read("out/study.csv")).size(), 10u);
}

TEST(CliStudy, APlotOfNothingIsRefusedBeforeAnyWork) {
  const Workplace place;
  place.write("study.toml", nine() + "[[outputs.plots]]\nx = \"sun.elevation_deg\"\ny = \"lux\"\n");
  const Finished run = place.run(kStudy);
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_NE(run.err.find("study.toml:29: key 'outputs.plots.y' = \"lux\""), std::string::npos)
      << run.err;
  place.write("study.toml", kScene + axis("aerosols.type", "[\"none\", \"urban\"]") +
                                "[sun]\nelevation_deg = 3\n[[outputs.plots]]\n"
                                "x = \"aerosols.type\"\ny = \"radiance\"\n");
  expect_refused(place.run(kStudy), {"key 'outputs.plots.x' = \"aerosols.type\"", "of numbers"});
  EXPECT_FALSE(fs::exists(place.path("out")));
}

TEST(CliStudy, WrongStudiesAreRefused) {
  const Workplace place;
  place.write("study.toml", nine() + "[[axis]]\nkey = \"earth.ground_albed\"\nvalues = [1]\n");
  expect_refused(place.run(kStudy), {"study.toml:30:", "did you mean 'earth.ground_albedo'?"});
  place.write("study.toml", kScene + axis("sun.elevation_deg", "[9]") + "[output]\nsiz = 3\n");
  expect_refused(place.run(kStudy), {"output.siz"});
  place.write("study.toml", kScene + axis("sun.elevation_deg", "[9]"));
  const Finished no_folder = place.run({"study", "study.toml"});
  EXPECT_EQ(no_folder.exit_code, 2);
  EXPECT_NE(no_folder.err.find("-o DIR"), std::string::npos) << no_folder.err;
  EXPECT_EQ(place.run({"study"}).exit_code, 2);
  expect_refused(place.run({"study", "--merge", "nowhere"}), {"nowhere: is no folder of a study"});
  EXPECT_EQ(place.names(), (std::set<std::string>{"study.toml"}));
}

}  // namespace
}  // namespace twilight
