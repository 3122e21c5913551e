// slave_io and master_io as they run, both with their drives on CAN: two simulated_drive processes for the
// arm, two for the master arm (whose hand swings two of its joints). On userspace buses, on the real clock,
// with times that a busy machine can keep. On SocketCAN: scripts/test_packages --vm.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>

#include "common/can/can_bus.hpp"
#include "common/can/canopen.hpp"
#include "common/can/cia402.hpp"
#include "common/core/joints.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "tests/support/child_process.hpp"

namespace phantom {
namespace {

constexpr auto kPatience = std::chrono::seconds(120);

using test::read_text;
using test::replaced;

/// The shipped files, on other buses, and the processes that run by them.
class Processes {
 public:
  Processes(const std::vector<std::string>& buses, int domain) : domain_(std::to_string(domain)) {
    std::filesystem::create_directories(folder_);
    const char* names[] = {"user:hot_cell_a", "user:hot_cell_b", "user:master_a", "user:master_b"};
    std::string slave = shipped("hot_cell_slave_io.yaml"), master = shipped("hot_cell_master_io.yaml");
    const char* drives[] = {"hot_cell_drives_a", "hot_cell_drives_b", "hot_cell_master_drives_a",
                            "hot_cell_master_drives_b"};
    for (std::size_t b = 0; b < 4; ++b) {
      std::string& arm = b < 2 ? slave : master;
      arm = replaced(arm, names[b], buses.at(b));
      const std::string file = std::string(drives[b]) + ".yaml";
      write(file, replaced(shipped(file), names[b], buses.at(b)));
    }
    for (std::string* arm : {&slave, &master}) {  // silence for a second or two is no fault on a busy machine
      *arm = replaced(*arm, "heartbeat_timeout_s: 0.5", "heartbeat_timeout_s: 3");
      *arm = replaced(*arm, "target_timeout_s: 0.5", "target_timeout_s: 3");
      *arm += "\nloop: {late_limit_s: 0.2, window_s: 3, most_late_s: 1}\n";
      *arm = replaced(*arm, "most_missed: 100", "most_missed: 1000");
      *arm = replaced(*arm, "staleness_s: 0.06", "staleness_s: 0.5");
      *arm = replaced(*arm, "round_trip_limit_s: 0.15", "round_trip_limit_s: 1");
      *arm = replaced(*arm, "state_timeout_s: 2", "state_timeout_s: 10");
    }
    // Nobody leads the simulated hand back to an arm that it has left behind.
    slave = replaced(slave, "range_rad: 0.5", "range_rad: 3");
    slave = replaced(slave, "range_m: 0.2", "range_m: 0.9");
    write("slave_io.yaml", slave);
    write("master_io.yaml", master);
    for (const char* name : drives) start(name, "simulated_drive", std::string(name) + ".yaml");
    start_slave();
    start("master_io", "master_io", "master_io.yaml");
  }
  void start_slave() { start("slave_io", "slave_io", "slave_io.yaml"); }
  ~Processes() {
    if (testing::Test::HasFailure()) {
      for (const auto& [name, process] : processes_) std::cerr << "---- " << name << '\n' << process.output();
    }
    processes_.clear();
    std::filesystem::remove_all(folder_);
  }
  /// kill -9.
  void kill_dead(const std::string& name) { processes_.erase(name); }
  void signal(const std::string& name, int number) { processes_.at(name).signal(number); }
  /// Asks it to end and returns its exit code.
  int end(const std::string& name) {
    const int code = processes_.at(name).end(SIGINT);
    processes_.erase(name);
    return code;
  }

 private:
  static std::string shipped(const std::string& file) {
    return read_text(PHANTOM_SOURCE_DIR "/deploy/can/" + file);
  }
  void write(const std::string& file, const std::string& text) { std::ofstream(folder_ / file) << text; }
  void start(const std::string& name, const std::string& component, const std::string& config) {
    std::vector<std::string> words{PHANTOM_BIN_DIR "/" + component, "--config", (folder_ / config).string()};
    words.insert(words.end(), {"--domain", domain_, "--deployment",
                               PHANTOM_SOURCE_DIR "/deploy/topologies/can_drives.yaml"});
    if (component != "simulated_drive")
      words.insert(words.end(), {"--state-dir", (folder_ / "state").string()});
    processes_.try_emplace(name, words, folder_ / (name + ".log"));
  }
  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("arm_on_can_" + std::to_string(getpid()));
  std::string domain_;
  std::map<std::string, test::Process> processes_;
};

/// Listens all the time to what the arm's drives say of their power.
class PowerWatch {
 public:
  explicit PowerWatch(const std::vector<std::string>& buses) {
    for (std::size_t b = 0; b < 2; ++b) {  // the arm's
      auto bus = can::open_bus(buses.at(b));
      if (!bus) throw std::runtime_error(bus.status().message());
      const can::CanFilter states{.id = can::kCobTpdo1, .mask = 0x780};
      if (const auto set = (*bus)->set_filters({&states, 1}); !set) throw std::runtime_error(set.message());
      listeners_.emplace_back([this, b, port = std::move(bus).value()](const std::stop_token& stop) {
        can::Received got;
        while (!stop.stop_requested()) {
          port->wait(10 * core::kNsPerMillisecond);
          while (port->receive(got)) take(b, got);
        }
      });
    }
  }
  /// How many drives said `state` last.
  int drives_in(can::PowerState state) {
    const std::lock_guard lock(mutex_);
    int so = 0;
    for (const auto& [node, last] : last_) so += last == state ? 1 : 0;
    return so;
  }
  /// How often a drive said anything, and that its operation is enabled, since the last call.
  std::pair<int, int> count() {
    const std::lock_guard lock(mutex_);
    return {std::exchange(heard_, 0), std::exchange(enabled_, 0)};
  }

 private:
  void take(std::size_t bus, const can::Received& got) {
    if (!got.is_frame() || got.frame.length < 2) return;
    const unsigned word = got.frame.data[0] | got.frame.data[1] << 8U;
    const std::lock_guard lock(mutex_);
    const can::PowerState state = can::power_state(static_cast<std::uint16_t>(word));
    last_[{bus, got.frame.id}] = state;
    ++heard_;
    enabled_ += state == can::PowerState::kOperationEnabled ? 1 : 0;
  }

  std::mutex mutex_;
  std::map<std::pair<std::size_t, std::uint32_t>, can::PowerState> last_;
  int heard_ = 0, enabled_ = 0;
  std::vector<std::jthread> listeners_;  // last: they end first
};

class ArmOnCan : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"a", "b", "ma", "mb"})
      buses_.push_back("user:" + std::to_string(getpid()) + "_" + name);
    const auto network = dds::test_network();
    processes_.emplace(buses_, network.domain);
    participant_.emplace("arm_on_can_test", network);
    stamper_.emplace(*participant_);
    commands_.emplace(*participant_, dds::kOperatorCommand);
    statuses_.emplace(*participant_, dds::kComponentStatus,
                      [this](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                        waiter_.change([&] { told_[s.component_name().to_string()] = s; });
                      });
    slaves_.emplace(
        *participant_, dds::kSlaveState, [this](const msg::SlaveState& s, const dds::SampleInfo&) {
          waiter_.change([&] {
            // Of samples that a busy host keeps apart for longer than 20 ms, the part of 20 ms.
            const double apart_s =
                slave_ ? core::seconds(s.stamp().monotonic_ns() - slave_->stamp().monotonic_ns()) : 0.0;
            for (std::size_t j = 0; slave_ && j < 7; ++j)
              greatest_step_ =
                  std::max(greatest_step_, std::abs(s.position_rad()[j] - slave_->position_rad()[j]) *
                                               std::min(1.0, 0.02 / std::max(1e-9, apart_s)));
            slave_ = s;
            ++slave_samples_;
          });
        });
    masters_.emplace(
        *participant_, dds::kMasterState,
        [this](const msg::MasterState& m, const dds::SampleInfo&) { waiter_.change([&] { master_ = m; }); });
  }
  bool eventually(const std::function<bool()>& holds) { return waiter_.wait(holds, kPatience); }
  bool both(msg::LinkState state) {
    return eventually(
        [&] { return slave_ && master_ && slave_->state() == state && master_->state() == state; });
  }
  bool told(const std::string& component, msg::ComponentState state, const std::string& words) {
    return eventually([&] {
      const auto& status = told_[component];
      return status.state() == state && status.message().to_string().find(words) != std::string::npos;
    });
  }
  // How both sides are, for a test that fails.
  std::string standing() {
    std::ostringstream text;
    waiter_.change([&] {
      text << "master: " << told_["master_io"].message() << "\nslave: " << told_["slave_io"].message();
      for (std::size_t j = 0; slave_ && master_ && j < 7; ++j)
        text << "\njoint " << j + 1 << ": master at " << master_->position_rad()[j] << ", slave at "
             << slave_->position_rad()[j] << " with " << slave_->velocity_rad_s()[j] << " per s";
    });
    return text.str();
  }
  void ask_for_reset(std::uint64_t master_stop, std::uint64_t slave_stop) {
    msg::OperatorCommand command;
    command.issuer("arm_on_can_test");
    command.kind(msg::CommandKind::COMMAND_RESET);
    command.master_stop(master_stop);
    command.slave_stop(slave_stop);
    command.stamp(stamper_->next());
    commands_->write(command);
  }
  // Drives that were frozen may need a reset more than once: what had piled up on the bus comes first.
  bool couples_after_a_reset() {
    for (int i = 0; i < 30; ++i) {
      std::uint64_t of_master = 0, of_slave = 0;
      waiter_.change([&] { of_master = master_->stop(), of_slave = slave_->stop(); });
      ask_for_reset(of_master, of_slave);
      if (waiter_.wait(
              [&] {
                return slave_->state() == msg::LinkState::LINK_COUPLED &&
                       master_->state() == msg::LinkState::LINK_COUPLED;
              },
              std::chrono::seconds(4)))
        return true;
    }
    return false;
  }

  dds::Waiter waiter_;
  std::map<std::string, msg::ComponentStatus> told_;
  std::vector<std::string> buses_;
  std::optional<msg::SlaveState> slave_;
  int slave_samples_ = 0;
  std::optional<msg::MasterState> master_;
  double greatest_step_ = 0.0;  // of any joint between two samples, in 20 ms at the most
  std::optional<Processes> processes_;
  std::optional<dds::Participant> participant_;
  std::optional<dds::Stamper> stamper_;
  std::optional<dds::Writer<msg::OperatorCommand>> commands_;
  std::optional<dds::Reader<msg::ComponentStatus>> statuses_;
  std::optional<dds::Reader<msg::SlaveState>> slaves_;
  std::optional<dds::Reader<msg::MasterState>> masters_;
};

// Tries slave_io: its drives in fault
// Tries master_io: slave stopped; its drives in fault
// Tries master_io: in fault; silent
TEST_F(ArmOnCan, TheArmFollowsTheHandAndFaultsOfEitherSidesDrivesStopItUntilAReset) {
  ASSERT_TRUE(both(msg::LinkState::LINK_COUPLED)) << standing();
  core::JointArray before{};
  waiter_.change([&] { before = master_->position_rad(), greatest_step_ = 0.0; });
  EXPECT_TRUE(eventually([&] {
    const double moved = std::abs(master_->position_rad()[1] - before[1]);
    const double apart = std::abs(master_->position_rad()[1] - slave_->position_rad()[1]);
    return moved > 0.1 && apart < 0.03 && slave_->state() == msg::LinkState::LINK_COUPLED;
  })) << "the hand moves the master, and the arm follows";

  processes_->signal("hot_cell_master_drives_a", SIGSTOP);
  EXPECT_TRUE(eventually([&] {
    return master_->stop_cause() == msg::StopCause::STOP_DRIVE_FAULT &&
           slave_->stop_cause() == msg::StopCause::STOP_PARTNER;
  }));
  EXPECT_TRUE(told("master_io", msg::ComponentState::COMPONENT_FAULT, "the drives coast until a reset"));
  processes_->signal("hot_cell_master_drives_a", SIGCONT);
  ASSERT_TRUE(couples_after_a_reset()) << standing();

  processes_->signal("hot_cell_drives_b", SIGSTOP);
  EXPECT_TRUE(eventually([&] {
    return slave_->stop_cause() == msg::StopCause::STOP_DRIVE_FAULT &&
           master_->stop_cause() == msg::StopCause::STOP_PARTNER;
  }));
  EXPECT_TRUE(told("slave_io", msg::ComponentState::COMPONENT_FAULT, "the drives hold until a reset"));
  processes_->signal("hot_cell_drives_b", SIGCONT);
  ASSERT_TRUE(couples_after_a_reset()) << standing();

  processes_->signal("slave_io", SIGUSR1);
  EXPECT_TRUE(both(msg::LinkState::LINK_STOPPED));
  EXPECT_TRUE(eventually([&] {
    return slave_->stop_cause() == msg::StopCause::STOP_EMERGENCY &&
           master_->stop_cause() == msg::StopCause::STOP_EMERGENCY;
  }));
  ASSERT_TRUE(couples_after_a_reset()) << standing();
  waiter_.change([&] { EXPECT_LT(greatest_step_, 0.1) << "nothing jumped"; });
  for (const char* name : {"master_io", "slave_io", "hot_cell_drives_a", "hot_cell_master_drives_b"})
    EXPECT_EQ(processes_->end(name), 0) << name;
}

// The whole process stands still for 0.3 s, again and again: less than its partner's patience, and the
// drives'.
// Tries slave_io: the servo's loop is held up
TEST_F(ArmOnCan, AServoThatIsHeldUpAgainAndAgainUncouplesTellsItAndCouplesAgainByItself) {
  ASSERT_TRUE(both(msg::LinkState::LINK_COUPLED)) << standing();
  double fastest = 0.0;  // of the joints' speeds, as a share of the limit in the URDF
  constexpr std::array kLimit{0.4, 1.2, 1.2, 1.2, 1.4, 1.4, 1.5};
  bool uncoupled = false;
  for (int i = 0; i < 100 && !uncoupled; ++i) {
    processes_->signal("slave_io", SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    processes_->signal("slave_io", SIGCONT);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    waiter_.change([&] {
      uncoupled = slave_->state() != msg::LinkState::LINK_COUPLED;
      for (std::size_t j = 0; j < kLimit.size(); ++j)
        fastest = std::max(fastest, std::abs(slave_->velocity_rad_s()[j]) / kLimit[j]);
    });
  }
  EXPECT_TRUE(uncoupled);
  EXPECT_TRUE(told("slave_io", msg::ComponentState::COMPONENT_DEGRADED, "the servo loop was held up "))
      << standing();
  EXPECT_LT(fastest, 1.25);
  waiter_.change([&] { EXPECT_EQ(slave_->stop(), 0U) << "it is no stop"; });
  EXPECT_TRUE(both(msg::LinkState::LINK_COUPLED)) << "without a reset: " << standing();
}

// kill -9 of a stopped slave_io and its restart: its drives get no power and nothing moves, until a reset
// that names the stop.
// Tries slave_io: slave_io dies
TEST_F(ArmOnCan, AStopOutlivesTheProcessAndNoDriveIsPoweredUntilAResetThatNamesIt) {
  ASSERT_TRUE(both(msg::LinkState::LINK_COUPLED)) << standing();
  PowerWatch power(buses_);
  processes_->signal("slave_io", SIGUSR1);
  ASSERT_TRUE(both(msg::LinkState::LINK_STOPPED)) << standing();
  // Its drives have been told, and stand.
  ASSERT_TRUE(eventually([&] {
    double fastest = 0.0;
    for (std::size_t j = 0; j < 7; ++j) fastest = std::max(fastest, std::abs(slave_->velocity_rad_s()[j]));
    return power.drives_in(can::PowerState::kQuickStopActive) == 7 && fastest < 1e-3;
  })) << standing();
  core::JointArray held{};
  std::uint64_t stop = 0;
  waiter_.change([&] { held = slave_->position_rad(), stop = slave_->stop(); });
  EXPECT_NE(stop, 0U);

  processes_->kill_dead("slave_io");
  power.count();  // of before
  int before = 0;
  waiter_.change([&] { before = slave_samples_; });
  processes_->start_slave();
  ASSERT_TRUE(eventually([&] { return slave_samples_ > before + 200; })) << standing();
  int others = 0;  // samples that say anything but the stop
  for (int i = 0; i < 3; ++i) {
    if (i == 1) ask_for_reset(0, 0);         // names no stop
    if (i == 2) ask_for_reset(stop, ~stop);  // names another
    int from = 0;
    waiter_.change([&] { from = slave_samples_; });
    ASSERT_TRUE(eventually([&] {
      others += slave_->state() == msg::LinkState::LINK_STOPPED && slave_->stop() == stop ? 0 : 1;
      return slave_samples_ > from + 300;
    }));
  }
  EXPECT_EQ(others, 0) << standing();
  const auto [heard, enabled] = power.count();
  EXPECT_EQ(enabled, 0);
  EXPECT_GT(heard, 100) << "the drives were heard all the time";
  waiter_.change([&] {
    for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(slave_->position_rad()[j], held[j], 2e-3) << j;
  });
  ASSERT_TRUE(couples_after_a_reset()) << standing();
  EXPECT_GT(power.count().second, 0);
}

}  // namespace
}  // namespace phantom
