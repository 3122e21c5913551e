// What every executable promises on its command line: the options, the exit codes, and one clear error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace phantom::end_to_end {
namespace {

using testing::AllOf;
using testing::HasSubstr;

struct Result {
  int exit_code;
  std::string output;
};

Result run(const std::string& executable, const std::string& arguments) {
  const std::string command = std::string(PHANTOM_BIN_DIR "/") + executable + " " + arguments + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  std::string output;
  std::array<char, 4096> buffer;
  while (const std::size_t got = fread(buffer.data(), 1, buffer.size(), pipe))
    output.append(buffer.data(), got);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), output};
}

class Executable : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string file(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  static std::string text_of(const std::filesystem::path& path) {
    std::ifstream stream(path);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
  }
  // The shipped topology with absolute paths and one text replaced.
  std::string topology(const std::string& from, const std::string& to) {
    std::string text = text_of(PHANTOM_SOURCE_DIR "/deploy/topologies/single_host.yaml");
    for (const auto& [relative, absolute] :
         {std::pair<std::string, std::string>{"../", PHANTOM_SOURCE_DIR "/deploy/"}}) {
      for (auto at = text.find(relative); at != std::string::npos;
           at = text.find(relative, at + absolute.size())) {
        text.replace(at, relative.size(), absolute);
      }
    }
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return file("topology.yaml", text.replace(at, from.size(), to));
  }
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("phantom_cli_" + std::to_string(getpid()));
};

TEST_P(Executable, HelpTeachesAndVersionIsTold) {
  const Result help = run(GetParam(), "--help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* option :
       {"--config", "--deployment", "--domain", "--log-level", "--check", "Exit codes"}) {
    EXPECT_THAT(help.output, HasSubstr(option));
  }
  const Result version = run(GetParam(), "--version");
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_THAT(version.output, HasSubstr("phantom 0."));
}

TEST_P(Executable, ShippedConfigurationIsValid) {
  const Result result = run(GetParam(), "--check");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("valid"));
}

TEST_P(Executable, WrongArgumentsEndWithTwo) {
  EXPECT_EQ(run(GetParam(), "--nonsense").exit_code, 2);
  EXPECT_EQ(run(GetParam(), "--domain 400 --check").exit_code, 2);
  EXPECT_EQ(run(GetParam(), "--log-level loud --check").exit_code, 2);
}

TEST_P(Executable, AMissingConfigurationIsNamed) {
  const Result result = run(GetParam(), "--check --config /nowhere/x.yaml");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr("/nowhere/x.yaml"));
}

TEST_P(Executable, AnUnknownKeyIsRefusedWithFileLineAndWhatIsAllowed) {
  const std::string shipped =
      text_of(std::string(PHANTOM_SOURCE_DIR "/components/") + GetParam() + "/" + GetParam() + ".yaml");
  const std::string path = file("odd.yaml", shipped + "\nsurprise_Nm: 3\n");
  const Result result = run(GetParam(), "--check --config " + path);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr(path + ":"), HasSubstr("surprise_Nm"), HasSubstr("allowed:")));
}

TEST_P(Executable, AQosProfileThatContradictsTheContractIsRefused) {
  std::string profiles = text_of(PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml");
  const std::string from = "<nanosec>20000000</nanosec>";
  profiles.replace(profiles.find(from), from.size(), "<nanosec>50000000</nanosec>");
  const std::string path = file("odd.xml", profiles);
  const Result result =
      run(GetParam(), "--check --deployment " + topology(PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml", path));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr(path), HasSubstr("master_state"), HasSubstr("deadline is 50 ms"),
                                   HasSubstr("20 ms")));
}

TEST_P(Executable, ABrokenTopologyIsNamed) {
  const Result result =
      run(GetParam(), "--check --deployment " + topology("domain: 42", "domain: forty-two"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr("domain"), HasSubstr("forty-two")));
}

INSTANTIATE_TEST_SUITE_P(Every, Executable,
                         testing::Values("wva_server", "slave_io", "phantom_sensing", "master_io",
                                         "audio_percept", "synthetic_viewer", "phantom_session",
                                         "dds_recorder", "dds_spy", "workspace_survey"),
                         [](const auto& name) { return std::string(name.param); });

class Parameters : public Executable {};

// The shipped file is the table that the executable reads by; of arms behind it the table of drives.
TEST_P(Parameters, HelpConfigIsTheShippedFile) {
  const Result help = run(GetParam(), "--help-config");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.output, testing::StartsWith(text_of(std::string(PHANTOM_SOURCE_DIR "/components/") +
                                                       GetParam() + "/" + GetParam() + ".yaml")));
}

INSTANTIATE_TEST_SUITE_P(Every, Parameters,
                         testing::Values("wva_server", "slave_io", "phantom_sensing", "master_io",
                                         "audio_percept", "synthetic_viewer", "phantom_session",
                                         "dds_recorder", "dds_spy", "workspace_survey", "simulated_drive"),
                         [](const auto& name) { return std::string(name.param); });

// A cell whose mesh, URDF or unit is wrong ends everyone who needs it, with its place named.
class BrokenCell : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::copy(PHANTOM_SOURCE_DIR "/deploy", folder_, std::filesystem::copy_options::recursive);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void replace_in_cell(const std::string& from, const std::string& to) {
    const auto path = folder_ / "cells/hot_cell/cell.yaml";
    std::ifstream stream(path);
    std::ostringstream text;
    text << stream.rdbuf();
    std::string cell = text.str();
    const auto at = cell.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    std::ofstream(path) << cell.replace(at, from.size(), to);
  }
  Result check(const std::string& executable) {
    return run(executable, "--check --deployment " + (folder_ / "topologies/single_host.yaml").string());
  }
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("phantom_deploy_" + std::to_string(getpid()));
};

TEST_F(BrokenCell, AMissingMesh) {
  std::filesystem::remove(folder_ / "cells/hot_cell/meshes/vice.stl");
  const Result result = check("wva_server");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr("cell.yaml:"), HasSubstr("vice.stl")));
}

TEST_F(BrokenCell, AMeshOfGarbage) {
  std::ofstream(folder_ / "cells/hot_cell/meshes/vice.stl") << "this is no mesh";
  const Result result = check("wva_server");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr("vice.stl"));
}

TEST_F(BrokenCell, AWrongUnit) {
  replace_in_cell("voxel_size_m: 0.005", "voxel_size_m: 5");
  const Result result = check("wva_server");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr("voxel_size_m"), HasSubstr("allowed: 0.0001 to 1 m")));
}

TEST_F(BrokenCell, AJointCountThatDoesNotMatch) {
  replace_in_cell("home: [", "home: [0.0, ");
  for (const char* executable : {"slave_io", "phantom_sensing", "master_io"}) {
    const Result result = check(executable);
    EXPECT_EQ(result.exit_code, 2) << executable;
    EXPECT_THAT(result.output, AllOf(HasSubstr("home"), HasSubstr("8"), HasSubstr("7"))) << executable;
  }
}

class SessionArguments : public testing::Test {
 protected:
  /// phantom_session with arguments that its components refuse; it leaves no report, so nothing was started.
  static Result refused(const std::string& arguments) {
    const auto report =
        std::filesystem::temp_directory_path() / ("phantom_refused_" + std::to_string(getpid()));
    std::filesystem::remove_all(report);
    const Result result =
        run("phantom_session", "--seconds 1 --report-dir " + report.string() + " " + arguments);
    EXPECT_FALSE(std::filesystem::exists(report)) << "something was started";
    std::filesystem::remove_all(report);
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
    return result;
  }
};

TEST_F(SessionArguments, ALawOrOperatorThatThereIsNotEndsWithTwoBeforeAnythingStarts) {
  const Result law = refused("--law q");
  EXPECT_EQ(law.exit_code, 2);
  EXPECT_THAT(law.output, AllOf(HasSubstr("master_io: --law: q not in"), HasSubstr("sctfb")));
  const Result operator_model = refused("--operator nobody");
  EXPECT_EQ(operator_model.exit_code, 2);
  EXPECT_THAT(operator_model.output, AllOf(HasSubstr("nobody not in"), HasSubstr("cautious")));
  EXPECT_EQ(refused("--driver steam").exit_code, 2);
}

TEST_F(SessionArguments, AMissingGamepadEndsWithThreeBeforeAnythingStarts) {
  if (std::filesystem::exists("/dev/input")) GTEST_SKIP() << "this machine may have a gamepad";
  const Result result = refused("--driver desk");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.output, AllOf(HasSubstr("master_io: "), HasSubstr("no gamepad or joystick"),
                                   HasSubstr("allowed: plug one in")));
}

}  // namespace
}  // namespace phantom::end_to_end
