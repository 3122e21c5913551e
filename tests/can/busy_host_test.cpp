// Frames that come late, in bunches and all at once, as from processes on a busy host, are not taken for a
// second device with the same node id; a second device is.
#include <gtest/gtest.h>

#include <random>

#include "tests/can/rig.hpp"

namespace phantom {
namespace {

using can::DriveFault;
using can::DriveGroupState;
using can::DriveMode;
using can::DrivePhase;
using test::group_config;
using test::Rig;

/// The times that deploy/can has for simulated drives on a desktop.
can::DriveGroupConfig patient_config(int drives) {
  auto config = group_config(DriveMode::kTorque, drives);
  config.timing.heartbeat_s = 0.05;
  config.timing.heartbeat_timeout_s = 0.5;
  config.timing.most_missed = 100;
  return config;
}

std::string names(const Rig& rig) {
  std::string all;
  for (std::size_t i = 0; i < rig.drives.size(); ++i)
    all += std::string(all.empty() ? "" : ", ") + name_of(rig.drive(i).fault);
  return all;
}

// The process of the drives stood still for 120 ms. What it answers then, the bus carries one by one, beside
// the new answers: for many cycles there are two answers in each.
TEST(BusyHost, AnswersThatPiledUpAreNotTakenForASecondDrive) {
  Rig rig(patient_config(3));
  ASSERT_TRUE(rig.bring_up());
  for (int again = 0; again < 5; ++again) {
    rig.frozen.assign(3, true);
    rig.run(0.12);
    rig.frozen.assign(3, false);
    rig.run(0.3);
    ASSERT_EQ(rig.state(), DriveGroupState::kEnabled) << again << ": " << rig.group->sentence();
  }
  EXPECT_GT(rig.drive(0).missed, 300U);
}

// The same for what comes to the master, for longer than a heartbeat may be missing: its own process stood
// still too.
TEST(BusyHost, HeartbeatsThatPiledUpAreNotTakenForASecondDrive) {
  for (const double stall_s : {0.06, 0.12, 0.3, 0.6, 1.5}) {
    auto config = patient_config(2);
    config.timing.heartbeat_s = 0.02;
    config.timing.heartbeat_timeout_s = 2.0;  // the drives are patient
    Rig rig(config);
    ASSERT_TRUE(rig.bring_up());
    rig.run(1.0);
    for (int again = 0; again < 5; ++again) {
      rig.master_frozen = rig.to_master->held = true;
      rig.run(stall_s);
      rig.master_frozen = rig.to_master->held = false;
      rig.run(0.2);
      ASSERT_EQ(rig.state(), DriveGroupState::kEnabled)
          << stall_s << " s, " << again << ": " << rig.group->sentence();
    }
  }
}

// Heartbeats of an earlier process, that had them come faster, say nothing of a second device.
TEST(BusyHost, HeartbeatsOfAnEarlierConfigurationAreNotTakenForASecondDrive) {
  auto config = patient_config(1);
  config.timing.heartbeat_s = 0.005;
  config.timing.heartbeat_timeout_s = 0.05;
  Rig rig(config);
  ASSERT_TRUE(rig.bring_up());
  config.timing.heartbeat_s = 0.05;
  config.timing.heartbeat_timeout_s = 0.1;
  std::vector<std::unique_ptr<can::CanBus>> ports;
  ports.push_back(rig.bus.connect("next master"));
  rig.group = std::make_unique<can::DriveGroup>(config, std::move(ports));
  rig.bus.set_faults(
      {{.id = can::kCobNmt, .mask = 0x7FF, .drop = 1.0}});  // it does not hear that it must boot
  auto other = rig.bus.connect("other");
  rig.on_cycle = [&] { other->send(can::heartbeat_frame(127, can::NmtState::kOperational)); };
  rig.run(0.5);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kNone) << rig.group->sentence();
  rig.on_cycle = {};
  rig.bus.set_faults({});
  EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
}

// Stalls of everybody at any time and of any length: faults there may be, but no second device.
TEST(BusyHost, WhoeverStandsStillWheneverThereIsNoSecondDrive) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    const auto upto = [&random](double most) { return most * static_cast<double>(random() % 10000) * 1e-4; };
    auto config = seed % 2 == 0 ? patient_config(3) : group_config(DriveMode::kTorque, 3);
    if (seed % 3 == 0) config.timing.most_missed = 30;
    Rig rig(config);
    rig.command.enable = true;
    for (int stall = 0; stall < 25; ++stall) {
      rig.run(upto(0.3));
      if (random() % 2 == 0) rig.master_frozen = true;
      if (random() % 2 == 0) rig.to_master->held = true;
      for (std::size_t i = 0; i < 3; ++i) rig.frozen[i] = random() % 2 == 0;
      rig.run(upto(random() % 4 == 0 ? 1.0 : 0.2));
      rig.master_frozen = rig.to_master->held = false;
      rig.frozen.assign(3, false);
      if (random() % 3 == 0) rig.reset();
      for (std::size_t i = 0; i < 3; ++i)
        ASSERT_NE(rig.drive(i).fault, DriveFault::kDuplicateNode) << "seed " << seed << ", stall " << stall;
    }
    rig.run(1.0);
    rig.reset();
    EXPECT_TRUE(rig.bring_up()) << seed << ": " << rig.group->sentence();
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_NE(rig.drive(i).fault, DriveFault::kDuplicateNode) << "seed " << seed << ": " << names(rig);
  }
}

/// A second device with node id 1 in what it sends: answers to SYNCs, heartbeats, or both.
class Twin {
 public:
  Twin(Rig& rig, bool answers, bool heartbeats, double heartbeat_s)
      : port_(rig.bus.connect("twin")), answers_(answers), heartbeats_(heartbeats), period_s_(heartbeat_s) {}
  void step(core::Nanoseconds now_ns) {
    can::Received got;
    while (port_->receive(got)) {
      if (!answers_ || !got.is_frame() || got.frame.id != can::kCobSync) continue;
      port_->send(
          {.id = can::kCobTpdo1 + 1, .length = can::kStatePdoBytes, .data = {0x37, 0x12, 0, 0, 0, 0, 10}});
    }
    if (!heartbeats_ || core::seconds(now_ns - sent_ns_) < period_s_) return;
    sent_ns_ = now_ns;
    port_->send({.id = can::kCobHeartbeat + 1, .length = 1, .data = {5}});
  }

 private:
  std::unique_ptr<can::CanBus> port_;
  bool answers_, heartbeats_;
  double period_s_;
  core::Nanoseconds sent_ns_ = 0;
};

TEST(BusyHost, ASecondDriveIsFoundByItsAnswersOrItsHeartbeats) {
  struct Case {
    bool answers, heartbeats, lossy;
    double strict_s, patient_s;  // within which it must be found
  };
  for (const Case& c : {Case{true, false, false, 0.1, 1.2}, Case{false, true, false, 0.5, 4.0},
                        Case{true, true, false, 0.1, 1.2}, Case{true, true, true, 0.3, 2.5}}) {
    for (const bool patient : {false, true}) {
      SCOPED_TRACE(testing::Message() << "answers " << c.answers << ", heartbeats " << c.heartbeats
                                      << ", lossy " << c.lossy << ", patient " << patient);
      const auto config = patient ? patient_config(2) : group_config(DriveMode::kTorque, 2);
      Rig rig(config);
      ASSERT_TRUE(rig.bring_up());
      if (c.lossy) rig.bus.set_faults({{.drop = 0.02, .duplicate = 0.02}});
      rig.run(5.0);
      ASSERT_EQ(rig.state(), DriveGroupState::kEnabled) << rig.group->sentence();
      Twin twin(rig, c.answers, c.heartbeats, config.timing.heartbeat_s);
      rig.on_cycle = [&] { twin.step(rig.bus.now_ns()); };
      const double took_ms = rig.run_until([&] { return rig.state() == DriveGroupState::kFault; }, 10.0);
      EXPECT_GE(took_ms, 0.0);
      EXPECT_LT(took_ms * 1e-3, patient ? c.patient_s : c.strict_s);
      EXPECT_EQ(rig.drive(0).fault, DriveFault::kDuplicateNode) << name_of(rig.drive(0).fault);
      RecordProperty("took_ms", static_cast<int>(took_ms));
    }
  }
}

// From the start on: they answer each request twice.
TEST(BusyHost, ASecondDriveThatIsThereFromTheStartIsFound) {
  Rig rig(patient_config(2));
  rig.add({.node = 1});
  rig.command.enable = true;
  EXPECT_GE(rig.run_until([&] { return rig.drive(0).fault == DriveFault::kDuplicateNode; }, 2.0), 0.0)
      << rig.group->sentence();
}

TEST(BusyHost, ASeldomLostRepeatedOrOvertakingFrameChangesNothing) {
  auto config = group_config(DriveMode::kPosition, 3);
  config.timing.heartbeat_timeout_s = 0.12;  // two in a row get lost now and then
  Rig rig(config);
  ASSERT_TRUE(rig.bring_up());
  rig.bus.set_faults({{.drop = 0.02, .duplicate = 0.02, .jitter_ns = 200'000}});
  rig.command.position.fill(0.5);
  rig.run(5.0);
  EXPECT_EQ(rig.state(), DriveGroupState::kEnabled) << rig.group->sentence();
  EXPECT_GT(rig.drive(0).missed, 0U);
  EXPECT_GT(rig.drive(0).surplus, 0U);
  for (const auto& drive : rig.drives) EXPECT_NEAR(drive->motor().joint_rad(), 0.5, 1e-3);
}

// As a simulated drive does on a busy desktop: every second answer comes with the next one.
TEST(BusyHost, ADriveThatAnswersLateIsNotTakenForTwo) {
  Rig rig(group_config(DriveMode::kPosition, 2));
  ASSERT_TRUE(rig.bring_up());
  rig.on_cycle = [&rig] { rig.frozen[0] = !rig.frozen[0]; };
  rig.run(2.0);
  EXPECT_EQ(rig.state(), DriveGroupState::kEnabled) << rig.group->sentence();
  EXPECT_GT(rig.drive(0).missed, 400U) << "SYNCs that were not answered before the next one";
}

TEST(BusyHost, ComesUpOnABusThatLosesFrames) {
  Rig rig(group_config(DriveMode::kTorque, 2));
  rig.bus.set_faults({{.drop = 0.02, .duplicate = 0.02}});
  EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
}

}  // namespace
}  // namespace phantom
