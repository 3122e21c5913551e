#include "common/dds/endpoints/dds_threads.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "fast_dds/threads.hpp"

namespace phantom::dds {
namespace {

constexpr int kPriority = 7;

struct Scheduling {
  int policy = 0, priority = 0, niceness = 0;
  std::string name;
};

// Every thread of this process as the kernel schedules it (proc(5): fields 19, 40 and 41 of stat).
std::map<std::string, Scheduling> threads() {
  std::map<std::string, Scheduling> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream file(entry.path() / "stat");
    std::string text((std::istreambuf_iterator<char>(file)), {});
    if (text.empty()) continue;  // it has ended meanwhile
    std::istringstream fields(text.substr(text.rfind(')') + 1));
    std::string field;
    Scheduling scheduling;
    for (int number = 3; fields >> field; ++number) {
      if (number == 19) scheduling.niceness = std::stoi(field);
      if (number == 40) scheduling.priority = std::stoi(field);
      if (number == 41) scheduling.policy = std::stoi(field);
    }
    const auto from = text.find('(') + 1;
    scheduling.name = text.substr(from, text.rfind(')') - from);
    found[entry.path().filename()] = scheduling;
  }
  return found;
}

bool permitted() {
  bool yes = false;
  std::thread([&] {
    sched_param parameters{};
    parameters.sched_priority = kPriority;
    yes = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
  }).join();
  return yes;
}

core::NetworkOptions network(int servo_priority) {
  auto made = test_network();
  made.servo_priority = servo_priority;
  return made;
}

class DdsThreads : public testing::Test {
 protected:
  // Sends until the reader's process has heard of it; the threads that were started then.
  std::map<std::string, Scheduling> after_a_sample(int servo_priority) {
    const auto before = threads();
    Participant here("here", network(servo_priority)), there("there", network(0));
    Waiter waiter;
    int heard = 0;
    Reader<msg::SlaveState> reader(here, kSlaveState, [&](const msg::SlaveState&, const SampleInfo&) {
      waiter.change([&] { ++heard; });
    });
    Writer<msg::SlaveState> writer(there, kSlaveState);
    Stamper stamper(there);
    msg::SlaveState sample;
    for (int i = 0; i < 600 && !waiter.wait([&] { return heard > 0; }, std::chrono::seconds(0)); ++i) {
      sample.stamp(stamper.next());
      writer.write(sample);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    EXPECT_GT(heard, 0);
    std::map<std::string, Scheduling> started;
    for (const auto& [id, thread] : threads())
      if (!before.contains(id)) started[id] = thread;
    return started;
  }
  static int count(const std::map<std::string, Scheduling>& threads, const std::string& name) {
    return static_cast<int>(std::count_if(threads.begin(), threads.end(),
                                          [&](const auto& thread) { return thread.second.name == name; }));
  }
  static bool of_dds(const Scheduling& thread) { return fast_dds::is_own_thread(thread.name, "dds"); }
  static int count_of_dds(const std::map<std::string, Scheduling>& threads) {
    return static_cast<int>(std::count_if(threads.begin(), threads.end(),
                                          [](const auto& thread) { return of_dds(thread.second); }));
  }
};

TEST_F(DdsThreads, OnlyWhatReceivesSamplesIsAboveAllOrdinaryThreads) {
  if (!permitted()) GTEST_SKIP() << "no right to SCHED_FIFO here";
  const auto started = after_a_sample(20);
  EXPECT_EQ(count(started, "receiver"), 1);
  EXPECT_GE(count_of_dds(started), 6) << "two participants: events, discovery";
  int preferred = 0;
  for (const auto& [id, thread] : started) {
    const bool receives = thread.name == "receiver";
    EXPECT_EQ(thread.policy, receives ? SCHED_FIFO : SCHED_OTHER) << thread.name << ' ' << id;
    EXPECT_EQ(thread.priority, receives ? 16 : 0) << thread.name << ' ' << id;
    if (of_dds(thread)) preferred += thread.niceness == kHapticNiceness ? 1 : 0;
  }
  EXPECT_GE(preferred, 3) << "those of one of the two";
  EXPECT_LT(preferred, count_of_dds(started));
  int policy = SCHED_FIFO;
  sched_param parameters{};
  pthread_getschedparam(pthread_self(), &policy, &parameters);
  EXPECT_EQ(policy, SCHED_OTHER) << "the caller keeps its own";
}

TEST_F(DdsThreads, OutsideOfTheHapticPathTheyAreOrdinary) {
  const auto started = after_a_sample(0);
  EXPECT_EQ(count(started, "receiver"), 1);
  for (const auto& [id, thread] : started) {
    EXPECT_EQ(thread.policy, SCHED_OTHER) << thread.name << ' ' << id;
    EXPECT_EQ(thread.niceness, 0) << thread.name << ' ' << id;
  }
}

TEST_F(DdsThreads, AThreadOfAnotherKindKeepsItsPlace) {
  std::thread([] {
    pthread_setname_np(pthread_self(), "publisher");
    take_receivers_place(20);
    char name[16] = {};
    pthread_getname_np(pthread_self(), name, sizeof name);
    EXPECT_STREQ(name, "publisher");
  }).join();
}

TEST_F(DdsThreads, WhatIsThrownIsPassedOn) {
  EXPECT_THROW(with_dds_threads(true, [] { throw DdsError("refused"); }), DdsError);
}

}  // namespace
}  // namespace phantom::dds
