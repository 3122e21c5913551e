// Objects changed while phantom_sensing is cut off. A process of its own: Fast DDS 3 knows of the interfaces
// that were there when the process made its first participant, and this test makes one.
#include <gtest/gtest.h>

#include <set>

#include "tests/end_to_end/workspace_processes.hpp"

namespace phantom::end_to_end {
namespace {

using test::run_line;
using test::Said;

/// phantom_sensing in a network namespace of its own, with one cable to the rest, which a test may cut.
class CutOff : public Processes {
 protected:
  void SetUp() override {
    Processes::SetUp();
    const std::string n = std::to_string(getpid() % 250);
    space_ = "phantom_" + n, cable_ = "phcable" + n, far_end_ = "phfar" + n;
    here_ = "10.199." + n + ".1", there_ = "10.199." + n + ".2";
    if (geteuid() != 0 || run_line("ip netns add " + space_).exit_code != 0)
      GTEST_SKIP() << "needs root and network namespaces";
    const std::string in_space = "ip -n " + space_ + " ";
    const std::string steps[] = {
        "ip link add " + cable_ + " type veth peer name " + far_end_ + " netns " + space_,
        "ip addr add " + here_ + "/24 dev " + cable_,
        "ip link set " + cable_ + " up",
        in_space + "addr add " + there_ + "/24 dev " + far_end_,
        in_space + "link set lo up",
        in_space + "link set " + far_end_ + " up"};
    for (const std::string& step : steps) {
      if (const Said said = run_line(step); said.exit_code != 0) GTEST_SKIP() << step << ": " << said.output;
    }
    // The kernel says a little later that there is a link.
    ASSERT_TRUE(eventually([&] {
      return run_line(in_space + "-o link show up dev " + far_end_).output.find("state UP") !=
             std::string::npos;
    }));
  }
  void TearDown() override {
    Processes::TearDown();
    run_line("ip netns del " + space_);
    run_line("ip link del " + cable_);
  }
  void cut() { ASSERT_EQ(run_line("ip -n " + space_ + " link set " + far_end_ + " down").exit_code, 0); }
  void mend() { ASSERT_EQ(run_line("ip -n " + space_ + " link set " + far_end_ + " up").exit_code, 0); }

  /// Percepts rest on the newest version again, and never on one that was not.
  void expect_right(WorkspaceObserver& observer, const std::set<std::uint64_t>& versions) {
    EXPECT_TRUE(eventually([&] { return observer.felt_version() == *versions.rbegin(); }, 60.0))
        << observer.felt_version() << " instead of " << *versions.rbegin();
    for (const std::uint64_t felt : observer.felt_versions()) EXPECT_TRUE(versions.contains(felt)) << felt;
  }

  std::string space_, cable_, far_end_, here_, there_;
};

// Tries wva_server: was away
TEST_F(CutOff, APhantomThatIsCutOffDuringChangesEndsWithTheRightVersion) {
  // Who commands sits at the server's host: a process that begins refuses an interface whose cable is cut.
  const std::string near = topology("near.yaml", "127.0.0.1, " + here_), far = topology("far.yaml", there_),
                    at_hand = topology("at_hand.yaml", "127.0.0.1");
  WorkspaceObserver observer(network({"127.0.0.1", here_}));
  start_server(near);
  start_sensing(far, {"ip", "netns", "exec", space_});
  ASSERT_TRUE(eventually(
      [&] { return observer.felt_version() != 0 && observer.felt_version() == observer.version(); }));
  std::set<std::uint64_t> versions{observer.version()};
  const auto change = [&](const std::string& words) {
    const Said said = command(words, at_hand, domain_);
    ASSERT_EQ(said.exit_code, 0) << said.output;
    versions.insert(version_in(said.output));
  };

  // For less than the participants' lease: what was lost is sent again.
  cut();
  change(move_to(0.0));
  change("remove --object vice");
  mend();
  expect_right(observer, versions);

  // Until both sides have forgotten each other.
  ASSERT_TRUE(eventually([&] { return observer.brick_readers() == 2; }));
  cut();
  change("remove --object lead_wall");
  change(move_to(-0.1));
  ASSERT_TRUE(eventually([&] { return observer.brick_readers() == 1; }, 60.0)) << observer.brick_readers();
  change(move_to(0.1));
  mend();
  expect_right(observer, versions);
}

}  // namespace
}  // namespace phantom::end_to_end
