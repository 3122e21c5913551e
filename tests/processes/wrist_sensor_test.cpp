// The shipped example of a force/torque sensor at the wrist, by real processes: a person at a shell tares it,
// and the arm that meets a wall feels that by it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "tests/processes/running_process.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/own_domain.hpp"

namespace phantom::processes {
namespace {

using test::eventually;
using testing::HasSubstr;
constexpr std::size_t kWrist = 5;  // j6_wrist, whose wall the tool meets

class WristSensorExample : public testing::Test {
 protected:
  WristSensorExample() {
    const std::string source = PHANTOM_SOURCE_DIR "/deploy/";
    std::string topology = test::text_of(source + "topologies/wrist_sensor.yaml");
    for (const char* name :
         {"hot_cell_drives_a.yaml", "hot_cell_wrist_drives_b.yaml", "hot_cell_wrist_slave_io.yaml"}) {
      std::string text = test::all_replaced(test::text_of(source + "can/" + name), "user:hot_cell", bus_);
      if (std::string(name).find("slave_io") != std::string::npos) text = patient(text);
      std::ofstream(folder_ / name) << text;
      topology = test::all_replaced(topology, std::string("../can/") + name, (folder_ / name).string());
    }
    std::ofstream(topology_) << test::all_replaced(topology, "../", source);
  }
  /// Silence for a second or two is no fault on a busy machine.
  static std::string patient(std::string text) {
    for (const auto& [from, to] :
         std::map<std::string, std::string>{{"heartbeat_timeout_s: 0.5", "heartbeat_timeout_s: 3"},
                                            {"target_timeout_s: 0.5", "target_timeout_s: 3"},
                                            {"most_missed: 100", "most_missed: 1000"},
                                            {"state_timeout_s: 2", "state_timeout_s: 10"},
                                            {"  staleness_s: 0.05", "  staleness_s: 0.5"},
                                            {"  staleness_s: 0.06", "  staleness_s: 0.5"},
                                            {"round_trip_limit_s: 0.15", "round_trip_limit_s: 1"}})
      text = test::replaced(text, from, to);
    return text + "\nloop: {late_limit_s: 0.2, window_s: 3, most_late_s: 1}\n";
  }
  std::unique_ptr<RunningProcess> start(const std::string& name, const std::string& config = "") {
    RunningProcess::Options options{
        .arguments = {"--deployment", topology_.string(), "--domain", std::to_string(domain_)}};
    if (!config.empty())
      options.arguments.insert(options.arguments.end(), {"--config", (folder_ / config).string()});
    return std::make_unique<RunningProcess>(name, options, folder_);
  }
  /// A person at a shell.
  test::Said shell(const std::string& words) const {
    return test::run_line(PHANTOM_BIN_DIR "/slave_io " + words + " --deployment " + topology_.string() +
                          " --domain " + std::to_string(domain_));
  }
  messages::SlaveState arm() {
    const std::lock_guard lock(mutex_);
    return arm_;
  }

  const int domain_ = test::own_domain();
  const std::string bus_ = "user:wrist_" + std::to_string(getpid());
  const std::filesystem::path folder_ = test::new_folder(), topology_ = folder_ / "topology.yaml";
  std::mutex mutex_;
  messages::SlaveState arm_;
  double felt_Nm_ = 0.0, felt_N_ = 0.0;  // greatest in contact
  dds::Participant observer_{"observer",
                             {.domain = domain_,
                              .qos_profiles = PHANTOM_SOURCE_DIR "/deploy/qos/phantom.xml",
                              .interfaces = {"127.0.0.1"}}};
  dds::Reader<msg::SlaveState> arms_{observer_, dds::kSlaveState,
                                     [this](const msg::SlaveState& message, const dds::SampleInfo&) {
                                       const auto state = messages::from_idl(message);
                                       const std::lock_guard lock(mutex_);
                                       if (!state) return false;
                                       arm_ = *state;
                                       if (arm_.contact && arm_.force_measured) {
                                         felt_Nm_ = std::max(felt_Nm_, arm_.external_torque_Nm[kWrist]);
                                         felt_N_ = std::max(felt_N_, arm_.contact_force_N);
                                       }
                                       return true;
                                     }};
};

TEST_F(WristSensorExample, APersonTaresItAndTheToolThatMeetsTheWallIsFelt) {
  const auto drives_a = start("simulated_drive", "hot_cell_drives_a.yaml");
  const auto drives_b = start("simulated_drive", "hot_cell_wrist_drives_b.yaml");
  test::Said checked;
  ASSERT_TRUE(eventually([&] { return (checked = shell("--check")).exit_code == 0; }, 60.0))
      << checked.output;
  EXPECT_THAT(checked.output, HasSubstr("force sensor on " + bus_ + "_b: measures"));
  const auto slave = start("slave_io");
  ASSERT_TRUE(eventually([&] { return arm().stamp.sequence_number != 0; }, 120.0)) << slave->log();
  EXPECT_FALSE(arm().force_measured) << "before the first tare";
  ASSERT_TRUE(eventually([&] { return shell("command tare --timeout-s 20").exit_code == 0; }, 120.0));
  ASSERT_TRUE(eventually([&] { return arm().force_measured; }, 60.0)) << slave->log();
  EXPECT_EQ(arm().external_torque_Nm, core::JointArray{}) << "the offset is taken away";
  EXPECT_FALSE(arm().contact);

  const auto master = start("master_io");
  ASSERT_TRUE(eventually(
      [&] {
        const std::lock_guard lock(mutex_);
        return felt_Nm_ > 2.0;
      },
      240.0))
      << slave->log() << master->log();
  const std::lock_guard lock(mutex_);
  // The wall pushes the joint back, along the normal at the tool's tip.
  EXPECT_GT(felt_N_, felt_Nm_ / 0.25 - 8.0);
}

}  // namespace
}  // namespace phantom::processes
