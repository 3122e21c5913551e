#include "common/dds/recovery/lease_monitor.hpp"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <string>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/tests/prefixes.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::dds {
namespace {

FoundParticipant event_of(std::uint8_t number, Discovered event) {
  FoundParticipant found;
  found.event = event;
  found.guid.guidPrefix.value[11] = number;
  found.lease = {static_cast<std::int32_t>(wire::kUncheckedLease_s), 0};
  return found;
}

TEST(LeaseMonitor, ReportsWhoLapsedAsLostAndOthersAsLeft) {
  LeaseMonitor monitor;
  for (const std::uint8_t number : {std::uint8_t{1}, std::uint8_t{2}}) {
    monitor.announced(prefix(number), 5.5);
    const FoundParticipant found = monitor.judged(event_of(number, Discovered::kFound));
    EXPECT_EQ(found.lease.seconds, 5) << "as announced, not as Fast DDS read it";
    EXPECT_EQ(found.lease.nanosec, 500'000'000U);
  }
  monitor.lapse(prefix(1));
  EXPECT_EQ(monitor.take_lapsed(), std::vector<GuidPrefix>{prefix(1)});
  EXPECT_TRUE(monitor.take_lapsed().empty()) << "each once";
  EXPECT_EQ(monitor.judged(event_of(1, Discovered::kLeft)).event, Discovered::kLost);
  EXPECT_EQ(monitor.judged(event_of(2, Discovered::kLeft)).event, Discovered::kLeft);
}

TEST(LeaseMonitor, ForgetsALapseOnceTheParticipantIsFoundAgain) {
  LeaseMonitor monitor;
  monitor.announced(prefix(1), 5);
  monitor.lapse(prefix(1));
  monitor.judged(event_of(1, Discovered::kLeft));
  monitor.announced(prefix(1), 5);
  monitor.judged(event_of(1, Discovered::kFound));
  EXPECT_EQ(monitor.judged(event_of(1, Discovered::kLeft)).event, Discovered::kLeft);
}

TEST(LeaseMonitor, AsksTheTransportOnlyWhileThereIsOne) {
  LeaseMonitor monitor;
  int looks = 0;
  monitor.look();
  monitor.attach([&] { ++looks; });
  monitor.look();
  monitor.attach({});
  monitor.look();
  EXPECT_EQ(looks, 1);
}

struct Observer : DiscoveryEvents {
  std::atomic<int> came{0}, left{0}, lost{0}, lease_s{0};
  void on_participant(const FoundParticipant& found) override {
    if (found.name == "killed") lease_s = found.lease.seconds;
    came += found.event == Discovered::kFound ? 1 : 0;
    left += found.event == Discovered::kLeft ? 1 : 0;
    lost += found.event == Discovered::kLost ? 1 : 0;
  }
};

constexpr const char* kDomain = "PHANTOM_TEST_DOMAIN";

/// This executable as another process, with a participant, until it is killed or this one ends. A copy of
/// this process alone would give its participant the same GUID.
class OtherProcess {
 public:
  explicit OtherProcess(const core::NetworkOptions& network) : pid_(fork()) {
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    setenv(kDomain, std::to_string(network.domain).c_str(), 1);
    execl("/proc/self/exe", "dds_test", "--gtest_also_run_disabled_tests",
          "--gtest_filter=LostParticipant.DISABLED_AsTheOtherProcess", nullptr);
    _exit(127);
  }
  ~OtherProcess() {
    send(SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;
  void send(int signal) const { kill(pid_, signal); }

 private:
  const pid_t pid_;
};

TEST(LostParticipant, DISABLED_AsTheOtherProcess) {
  core::NetworkOptions network = test_network();
  const char* const domain = std::getenv(kDomain);
  ASSERT_NE(domain, nullptr);
  network.domain = std::stoi(domain);
  const Participant participant("killed", network);
  for (;;) pause();
}

TEST(LostParticipant, IsReportedOnceItsLeaseHasRunOutAndFoundWhenItGoesOn) {
  const core::NetworkOptions network = test_network();
  const OtherProcess other(network);
  const auto observer = std::make_shared<Observer>();
  const Participant keeper("keeper", network, observer);
  ASSERT_TRUE(eventually([&] { return observer->came == 1; }));
  EXPECT_EQ(observer->lease_s, 5);

  other.send(SIGSTOP);
  ASSERT_TRUE(eventually([&] { return observer->lost == 1; }));
  other.send(SIGCONT);
  ASSERT_TRUE(eventually([&] { return observer->came == 2; }));

  other.send(SIGKILL);
  ASSERT_TRUE(eventually([&] { return observer->lost == 2; }));
  EXPECT_EQ(observer->left, 0);
}

}  // namespace
}  // namespace phantom::dds
