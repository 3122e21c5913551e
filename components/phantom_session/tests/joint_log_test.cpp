#include "components/phantom_session/joint_log.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace phantom::phantom_session {
namespace {

JointRow row_at(double t_s) {
  JointRow row{.t_s = t_s, .reach = 2, .law = "pe"};
  row.master_position[0] = 5.0 * t_s;  // moves far, feels nothing
  row.master_position[1] = t_s;
  row.percept_torque[1] = -0.5;
  row.operator_torque[1] = 0.75;
  row.feedback_torque[1] = -0.125;
  return row;
}

TEST(JointLog, KeepsRowsAtItsIntervalWithTheNewestSlave) {
  JointLog log(0.0095);
  core::JointArray slave{};
  for (int i = 0; i < 100; ++i) {
    slave[0] = i;
    log.on_slave(slave);
    log.on_master(2, row_at(0.001 * i));
  }
  ASSERT_EQ(log.rows().size(), 10U);
  EXPECT_EQ(log.rows()[3].slave_position[0], 30);
}

TEST(JointLog, TheJointWorthLookingAtIsTheOneThatFelt) {
  JointLog log(0.0);
  log.on_master(2, row_at(0.0));
  EXPECT_FALSE(log.most_telling().has_value()) << "no row before the slave is heard";
  log.on_slave({});
  for (int i = 0; i < 10; ++i) log.on_master(2, row_at(0.1 * i));
  EXPECT_EQ(log.most_telling(), 1U);
}

TEST(JointLog, WritesOneColumnPerJointAndSignal) {
  JointLog log(0.0);
  log.on_slave({});
  log.on_master(2, row_at(1.5));
  const auto folder =
      std::filesystem::temp_directory_path() / ("phantom_joint_log_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  log.write(folder);
  std::ifstream file(folder / "joints.csv");
  std::string head, line;
  std::getline(file, head);
  std::getline(file, line);
  EXPECT_EQ(head,
            "t_s,reach,law,master1,slave1,operator1,percept1,feedback1,master2,slave2,operator2,percept2,"
            "feedback2");
  EXPECT_EQ(line, "1.5,2,pe,7.5,0,0,0,0,1.5,0,0.75,-0.5,-0.125");
  std::filesystem::remove_all(folder);
  EXPECT_THROW(log.write(folder), std::runtime_error);
}

}  // namespace
}  // namespace phantom::phantom_session
