// What every executable promises on its command line: the options, the exit codes, and one clear error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/child_process.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::end_to_end {
namespace {

using testing::AllOf;
using testing::HasSubstr;

test::Said run(const std::string& executable, const std::string& arguments) {
  return test::run_line(std::string(PHANTOM_BIN_DIR "/") + executable + " " + arguments);
}

class Files : public testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  // The shipped topology with absolute paths and one text replaced.
  std::string topology(const std::string& from, const std::string& to) {
    const std::string shipped = test::text_of(PHANTOM_SOURCE_DIR "/deploy/topologies/single_host.yaml");
    const std::string text = test::all_replaced(shipped, "../", PHANTOM_SOURCE_DIR "/deploy/");
    return file("topology.yaml", test::replaced(text, from, to));
  }
  const std::filesystem::path folder_ = test::new_folder();
};

class Executable : public Files, public testing::WithParamInterface<const char*> {};

TEST_P(Executable, HelpTeachesAndVersionIsTold) {
  const test::Said help = run(GetParam(), "--help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* option :
       {"--config", "--deployment", "--domain", "--log-level", "--check", "Exit codes"}) {
    EXPECT_THAT(help.output, HasSubstr(option));
  }
  const test::Said version = run(GetParam(), "--version");
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_THAT(version.output, HasSubstr("phantom 0."));
}

TEST_P(Executable, ShippedConfigurationIsValid) {
  const test::Said result = run(GetParam(), "--check");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("valid"));
}

TEST_P(Executable, WrongArgumentsEndWithTwo) {
  EXPECT_EQ(run(GetParam(), "--nonsense").exit_code, 2);
  EXPECT_EQ(run(GetParam(), "--domain 400 --check").exit_code, 2);
  EXPECT_EQ(run(GetParam(), "--log-level loud --check").exit_code, 2);
}

TEST_P(Executable, AMissingConfigurationIsNamed) {
  const test::Said result = run(GetParam(), "--check --config /nowhere/x.yaml");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.output, HasSubstr("/nowhere/x.yaml"));
}

TEST_P(Executable, AnUnknownKeyIsRefusedWithFileLineAndWhatIsAllowed) {
  const std::string shipped =
      test::text_of(std::string(PHANTOM_SOURCE_DIR "/components/") + GetParam() + "/" + GetParam() + ".yaml");
  const std::string path = file("odd.yaml", shipped + "\nsurprise_Nm: 3\n");
  const test::Said result = run(GetParam(), "--check --config " + path);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr(path + ":"), HasSubstr("surprise_Nm"), HasSubstr("allowed:")));
}

TEST_P(Executable, AQosProfileThatContradictsTheContractIsRefused) {
  const std::string path = file(
      "odd.xml",
      "<dds><profiles><data_writer profile_name=\"master_state\"><qos><deadline><period><nanosec>50000000"
      "</nanosec></period></deadline></qos></data_writer></profiles></dds>");
  const test::Said result =
      run(GetParam(), "--check --deployment " + topology(PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml", path));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr(path), HasSubstr("master_state"), HasSubstr("deadline is 50 ms"),
                                   HasSubstr("20 ms")));
}

TEST_P(Executable, ABrokenTopologyIsNamed) {
  const test::Said result =
      run(GetParam(), "--check --deployment " + topology("domain: 42", "domain: forty-two"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr("domain"), HasSubstr("forty-two")));
}

INSTANTIATE_TEST_SUITE_P(Every, Executable,
                         testing::Values("wva_server", "slave_io", "phantom_sensing", "master_io",
                                         "audio_percept", "synthetic_viewer", "phantom_session",
                                         "dds_recorder", "dds_spy", "workspace_survey", "ros2_gateway",
                                         "workspace_camera"),
                         [](const auto& name) { return std::string(name.param); });

class Parameters : public Executable {};

// Also of an executable that takes nothing from a topology.
TEST_P(Parameters, AMissingTopologyIsNamed) {
  for (const char* named : {"--check --deployment", "--deployment", "--topology"}) {
    const test::Said result = run(GetParam(), std::string(named) + " /nowhere/x.yaml");
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_THAT(result.output, HasSubstr("/nowhere/x.yaml"));
  }
}

// The shipped file is the table that the executable reads by; of arms behind it the table of drives.
TEST_P(Parameters, HelpConfigIsTheShippedFile) {
  const test::Said help = run(GetParam(), "--help-config");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.output, testing::StartsWith(test::text_of(std::string(PHANTOM_SOURCE_DIR "/components/") +
                                                             GetParam() + "/" + GetParam() + ".yaml")));
}

TEST_P(Parameters, HelpTellsTheKeysOfTheFilesThatAreShared) {
  const auto text = [](const char* name) {
    return test::text_of(std::string(PHANTOM_SOURCE_DIR "/common/runtime/") + name);
  };
  EXPECT_EQ(run(GetParam(), "--help-deployment").output, text("configuration/topology.yaml"));
  EXPECT_EQ(run(GetParam(), "--help-cell").output, text("cell/cell.yaml") + "\n" + text("cell/arm.yaml"));
}

INSTANTIATE_TEST_SUITE_P(Every, Parameters,
                         testing::Values("wva_server", "slave_io", "phantom_sensing", "master_io",
                                         "audio_percept", "synthetic_viewer", "phantom_session",
                                         "dds_recorder", "dds_spy", "workspace_survey", "ros2_gateway",
                                         "workspace_camera", "simulated_drive"),
                         [](const auto& name) { return std::string(name.param); });

TEST(KeysOfFiles, ThoseThatOneComponentReadsAreShownByIt) {
  EXPECT_EQ(run("master_io", "--help-reaches").output,
            test::text_of(PHANTOM_SOURCE_DIR "/components/master_io/reaches.yaml"));
  EXPECT_EQ(run("workspace_survey", "--help-library").output,
            test::text_of(PHANTOM_SOURCE_DIR "/components/workspace_survey/library.yaml"));
  EXPECT_EQ(run("simulated_drive", "--eds").output,
            test::text_of(PHANTOM_SOURCE_DIR "/components/simulated_drive/simulated_drive.eds"));
}

// Whoever starts a process, a service manager or a person: it is what the topology says of it.
class OwnEntry : public Files {
 protected:
  std::string with(const std::string& entry) {
    return topology("{component: slave_io, simulation: true}", "{component: slave_io, " + entry + "}");
  }
};

TEST_F(OwnEntry, NamesItsParameters) {
  const test::Said result = run("slave_io", "--check --deployment " + with("config: /nowhere/drives.yaml"));
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.output, HasSubstr("/nowhere/drives.yaml"));
  const std::string on_can = with("config: " PHANTOM_SOURCE_DIR "/deploy/can/hot_cell_slave_io.yaml");
  EXPECT_EQ(run("slave_io", "--check --deployment " + on_can).exit_code, 0);
  // What the command line says wins, and is no fallback.
  const std::string shipped = PHANTOM_SOURCE_DIR "/components/slave_io/slave_io.yaml";
  const test::Said simulated = run("slave_io", "--check --deployment " + on_can + " --config " + shipped);
  EXPECT_EQ(simulated.exit_code, 2);
  EXPECT_THAT(simulated.output, HasSubstr("does not say simulation: true"));
}

// Tries slave_io: `driver: sim`
// Tries master_io: `driver: sim`
TEST_F(OwnEntry, NothingIsSimulatedUnlessItSaysSo) {
  for (const char* arm : {"slave_io", "master_io"}) {
    const std::string meant = std::string("{component: ") + arm + ", simulation: true}";
    const test::Said result =
        run(arm, "--check --deployment " + topology(meant, std::string("{component: ") + arm + "}"));
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_THAT(result.output, AllOf(HasSubstr("driver: sim, but "), HasSubstr("topology.yaml:"),
                                     HasSubstr("does not say simulation: true")));
    EXPECT_EQ(run(arm, "--deployment " + topology(meant, std::string("{component: ") + arm + "}")).exit_code,
              2);
  }
}

TEST_F(OwnEntry, OfANameThatTheTopologyLacksIsRefused) {
  for (const char* name : {"typo", "slave_io"}) {  // nobody's, and another component's
    const test::Said result = run("wva_server", std::string("--check --name ") + name);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.output, AllOf(HasSubstr(std::string("--name ") + name), HasSubstr("single_host.yaml"),
                                     HasSubstr("has no wva_server of that name"), HasSubstr("allowed: ")));
  }
}

TEST_F(OwnEntry, GivesArgumentsWhichThoseOfTheCommandLineFollow) {
  const auto master = [&](const std::string& arguments) {
    return topology("{component: master_io, simulation: true}",
                    "{component: master_io, simulation: true, arguments: [" + arguments + "]}");
  };
  const test::Said wrong = run("master_io", "--check --deployment " + master("--law, q"));
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.output,
              AllOf(HasSubstr("topology.yaml:"), HasSubstr("].arguments: --law: "), HasSubstr("q")));
  EXPECT_EQ(run("master_io", "--check --deployment " + master("--law, pe")).exit_code, 0);
  EXPECT_EQ(run("master_io", "--check --law pf --deployment " + master("--law, pe")).exit_code, 0);
  const test::Said stick =
      run("master_io", "--check --deployment " + master("--driver, desk, --desk-device, /nowhere"));
  EXPECT_EQ(stick.exit_code, 3) << stick.output;
  EXPECT_EQ(run("master_io",
                "--check --driver sim --deployment " + master("--driver, desk, --desk-device, /nowhere"))
                .exit_code,
            0);
}

// A cell whose mesh, URDF or unit is wrong ends everyone who needs it, with its place named.
class BrokenCell : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::copy(PHANTOM_SOURCE_DIR "/deploy", folder_, std::filesystem::copy_options::recursive);
  }
  void replace_in_cell(const std::string& from, const std::string& to) {
    const auto path = folder_ / "cells/hot_cell/cell.yaml";
    const std::string cell = test::replaced(test::text_of(path), from, to);
    std::ofstream(path) << cell;
  }
  test::Said check(const std::string& executable) {
    return run(executable, "--check --deployment " + (folder_ / "topologies/single_host.yaml").string());
  }
  const std::filesystem::path folder_ = test::new_folder();
};

// Tries wva_server: a mesh is missing
TEST_F(BrokenCell, AMissingMesh) {
  std::filesystem::remove(folder_ / "cells/hot_cell/meshes/vice.stl");
  const test::Said result = check("wva_server");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("cell.yaml:"), HasSubstr("objects[1].mesh"), HasSubstr("vice.stl")));
}

// Tries wva_server: garbage
TEST_F(BrokenCell, AMeshOfGarbage) {
  std::ofstream(folder_ / "cells/hot_cell/meshes/vice.stl") << "this is no mesh";
  const test::Said result = check("wva_server");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr("vice.stl"));
}

TEST_F(BrokenCell, AWrongUnit) {
  replace_in_cell("voxel_size_m: 0.005", "voxel_size_m: 5");
  const test::Said result = check("wva_server");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, AllOf(HasSubstr("voxel_size_m"), HasSubstr("allowed: 0.0001 to 1 m")));
}

// What a run warns of, the check does, too.
TEST_F(BrokenCell, SR27_WhatIsAssumedOfAMeshIsToldByTheCheck) {
  replace_in_cell("mesh: meshes/work_table.stl\n    mesh_scale: 0.001\n    up_axis: z\n",
                  "mesh: meshes/work_table.stl\n");
  const test::Said result = check("wva_server");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, AllOf(HasSubstr("work_table: "), HasSubstr("millimetres are assumed"),
                                   HasSubstr("declares no up-axis: +z is assumed")));
}

// Tries synthetic_viewer: a link mesh is missing
TEST_F(BrokenCell, AMissingMeshOfALink) {
  std::filesystem::remove(folder_ / "cells/hot_cell/arm/meshes/forearm.stl");
  const test::Said result = check("synthetic_viewer");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.output, HasSubstr("forearm.stl"));
}

TEST_F(BrokenCell, AJointCountThatDoesNotMatch) {
  replace_in_cell("home: [", "home: [0.0, ");
  for (const char* executable : {"slave_io", "phantom_sensing", "master_io"}) {
    const test::Said result = check(executable);
    EXPECT_EQ(result.exit_code, 2) << executable;
    EXPECT_THAT(result.output, AllOf(HasSubstr("home"), HasSubstr("8"), HasSubstr("7"))) << executable;
  }
}

// Tries audio_percept: layout that OpenAL cannot render
TEST_F(Files, ASoundThatOpenAlCannotRenderIsNamed) {
  const std::string shipped = PHANTOM_SOURCE_DIR "/components/audio_percept/audio_percept.yaml";
  const std::string text = test::text_of(shipped);
  const auto channels = text.find("channels: ") + 10;
  const std::string layout = text.substr(channels, text.find(' ', channels) - channels);
  const std::string with_hrtf =
      file("hrtf.yaml", test::replaced(text, "channels: " + layout, "channels: hrtf"));
  const std::string alsoft = file("alsoft.conf", "[general]\nhrtf-paths=" + folder_.string() + "\n");
  const auto checked = [&](const std::string& parameters) {
    return test::run_line("ALSOFT_CONF=" + alsoft + " " PHANTOM_BIN_DIR "/audio_percept --check --config " +
                          parameters);
  };
  EXPECT_EQ(checked(shipped).exit_code, 0) << "no data are needed for " << layout;
  const test::Said result = checked(with_hrtf);
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_THAT(result.output, AllOf(HasSubstr("output.channels: hrtf"), HasSubstr("libopenal-data")));
}

class SessionArguments : public testing::Test {
 protected:
  /// phantom_session with arguments that its components refuse; it leaves no report, so nothing was started.
  static test::Said refused(const std::string& arguments) {
    const auto report =
        std::filesystem::temp_directory_path() / ("phantom_refused_" + std::to_string(getpid()));
    std::filesystem::remove_all(report);
    const test::Said result =
        run("phantom_session", "--seconds 1 --report-dir " + report.string() + " " + arguments);
    EXPECT_FALSE(std::filesystem::exists(report)) << "something was started";
    std::filesystem::remove_all(report);
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
    return result;
  }
};

// Tries phantom_session: a component refuses its arguments
TEST_F(SessionArguments, ALawOrOperatorThatThereIsNotEndsWithTwoBeforeAnythingStarts) {
  const test::Said law = refused("--law q");
  EXPECT_EQ(law.exit_code, 2);
  EXPECT_THAT(law.output, AllOf(HasSubstr("master_io: --law: q not in"), HasSubstr("sctfb")));
  const test::Said operator_model = refused("--operator nobody");
  EXPECT_EQ(operator_model.exit_code, 2);
  EXPECT_THAT(operator_model.output, AllOf(HasSubstr("nobody not in"), HasSubstr("cautious")));
  EXPECT_EQ(refused("--driver steam").exit_code, 2);
}

// Tries phantom_session: a component is not ready
TEST_F(Files, ASessionNamesWhoIsNotReadyAndEndsWithOne) {
  const std::string patience =
      test::replaced(test::text_of(PHANTOM_SOURCE_DIR "/components/phantom_session/phantom_session.yaml"),
                     "ready_timeout_s: 120", "ready_timeout_s: 2");
  std::string without;  // slave_io alone, whose drives' buses nobody serves
  for (const char* name : {"wva_server", "phantom_sensing", "master_io", "audio_percept", "synthetic_viewer",
                           "drives_a", "drives_b"})
    without += std::string(" --without ") + name;
  const test::Said result =
      test::run_line("PHANTOM_STATE_DIR=" + folder_.string() +
                     " " PHANTOM_BIN_DIR "/phantom_session --deployment " PHANTOM_SOURCE_DIR
                     "/deploy/topologies/can_drives.yaml --config " +
                     file("session.yaml", patience) + " --domain " + std::to_string(test::own_domain()) +
                     " --report-dir " + (folder_ / "report").string() + without);
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_THAT(result.output, HasSubstr("Not ready after 2 s: slave_io"));
}

// Tries master_io: `driver: desk`, and no device
// Tries phantom_session: a device or file that it needs
TEST_F(SessionArguments, AMissingGamepadEndsWithThreeBeforeAnythingStarts) {
  if (std::filesystem::exists("/dev/input")) GTEST_SKIP() << "this machine may have a gamepad";
  const test::Said result = refused("--driver desk");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.output, AllOf(HasSubstr("master_io: "), HasSubstr("no gamepad or joystick"),
                                   HasSubstr("allowed: plug one in")));
}

}  // namespace
}  // namespace phantom::end_to_end
