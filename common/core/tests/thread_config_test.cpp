#include "common/core/thread_config.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <cstring>
#include <set>
#include <sstream>
#include <thread>

#include "tests/support/files.hpp"

namespace phantom::core {
namespace {

TEST(ThreadConfig, TheServoComesBeforeThePublisherBeforeTheReceiverBeforeAllElse) {
  const auto at = [](ThreadRole role) { return fifo_priority(role, kServoPriority); };
  EXPECT_GT(at(ThreadRole::kServo), at(ThreadRole::kPublisher));
  EXPECT_GT(at(ThreadRole::kPublisher), at(ThreadRole::kReceiver));
  for (const ThreadConfig& place : thread_scheme()) {
    const bool first = place.role == ThreadRole::kServo || place.role == ThreadRole::kBareLoop ||
                       place.role == ThreadRole::kPublisher || place.role == ThreadRole::kCanBus ||
                       place.role == ThreadRole::kDrives || place.role == ThreadRole::kReceiver ||
                       place.role == ThreadRole::kDesk || place.role == ThreadRole::kSwitch;
    if (!first) {
      EXPECT_LT(at(place.role), at(ThreadRole::kReceiver)) << place.name;
    }
  }
}

TEST(ThreadConfig, WithoutAServoPriorityNobodyAsksForOne) {
  for (const ThreadConfig& place : thread_scheme()) EXPECT_EQ(fifo_priority(place.role, 0), 0);
  EXPECT_EQ(fifo_priority(ThreadRole::kControl, 1), 1) << "a low priority of the servo is nobody's zero";
}

TEST(ThreadConfig, NamesAreUniqueAndFitTheKernels) {
  std::set<std::string> names;
  for (const ThreadConfig& place : thread_scheme()) {
    EXPECT_LE(std::strlen(place.name), 15u) << place.name;
    if (place.name[0] != '\0') {
      EXPECT_TRUE(names.insert(place.name).second) << place.name;
    }
  }
}

TEST(ThreadConfig, AThreadTakesNameAndSchedulingAndGivesThemUp) {
  std::thread([] {
    char name[16] = {};
    int policy = -1;
    sched_param parameters{};
    const std::string refused = apply_thread_config(ThreadRole::kPublisher, kServoPriority);
    pthread_getname_np(pthread_self(), name, sizeof name);
    EXPECT_STREQ(name, "publisher");
    pthread_getschedparam(pthread_self(), &policy, &parameters);
    if (refused.empty()) {
      EXPECT_EQ(policy, SCHED_FIFO);
      EXPECT_EQ(parameters.sched_priority, kServoPriority - 2);
    } else {
      EXPECT_NE(refused.find("CAP_SYS_NICE"), std::string::npos);
      EXPECT_EQ(policy, SCHED_OTHER);
    }
    EXPECT_EQ(apply_thread_config(ThreadRole::kOutput, kServoPriority), "");
    pthread_getschedparam(pthread_self(), &policy, &parameters);
    EXPECT_EQ(policy, SCHED_OTHER) << "an inherited priority is given up";
  }).join();
}

std::string table() {
  std::ostringstream text;
  text << "| thread | process | does | SCHED_FIFO | may block on |\n|---|---|---|---|---|\n";
  for (const ThreadConfig& place : thread_scheme()) {
    const int priority = fifo_priority(place.role, kServoPriority);
    text << "| " << (place.name[0] != '\0' ? "`" + std::string(place.name) + "`" : "(the executable's name)")
         << " | " << place.processes << " | " << place.does << " | "
         << (priority > 0 ? std::to_string(priority) : "–") << " | " << place.may_block_on << " |\n";
  }
  return text.str();
}

TEST(ThreadConfig, TheDocumentShowsTheScheme) {
  EXPECT_NE(test::text_of(PHANTOM_SOURCE_DIR "/docs/threads.md").find(table()), std::string::npos)
      << "put this table there:\n"
      << table();
}

}  // namespace
}  // namespace phantom::core
