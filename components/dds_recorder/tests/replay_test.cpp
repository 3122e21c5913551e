// When what is published again, under which name, with which stamps. The clock is the test's.
#include "components/dds_recorder/replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/core/errors.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "components/dds_recorder/adapter/dds_adapter_restamp.hpp"
#include "components/dds_recorder/tests/fake_world.hpp"

namespace phantom::dds_recorder {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Time passes only while the replay sleeps.
struct VirtualClock : ReplayClock {
  core::Nanoseconds now_ns() override { return now; }
  bool sleep_until(core::Nanoseconds at_ns) override {
    now = std::max(now, at_ns);
    return now < end;
  }
  core::Nanoseconds now = 1000 * FakeWorld::kSecond, end = std::numeric_limits<core::Nanoseconds>::max();
};

struct Sent {
  std::string topic;
  std::uint32_t number;
  core::Nanoseconds at_ns;
  bool operator==(const Sent&) const = default;
};

struct NotedSink : ReplaySink {
  explicit NotedSink(VirtualClock& of) : clock(of) {}
  void begin(core::Nanoseconds now_ns) override { starts.push_back(now_ns - 1000 * FakeWorld::kSecond); }
  bool write(const std::string& topic, const recording::Message& message, core::Nanoseconds due_ns) override {
    EXPECT_EQ(due_ns, clock.now) << "at its time";
    sent.push_back({topic, message.sequence, clock.now - 1000 * FakeWorld::kSecond});
    return true;
  }
  VirtualClock& clock;
  std::vector<Sent> sent;
  std::vector<core::Nanoseconds> starts;
};

/// 10 s of two volatile topics at 10 Hz and a durable one; in two files.
class Replayed : public testing::Test {
 protected:
  Replayed() {
    RecorderSettings settings;
    settings.split_ns = 6 * FakeWorld::kSecond;
    const auto owner = world.recorder(settings);
    Recorder& recorder = *owner;
    const TopicNumber command =
        recorder.add_topic({"arm_command", "C", false, false, "", "", {{"durability", "volatile"}}});
    recorder.tick(0);
    recorder.take(world.sample(world.brick, 1, 0, {1, 1}));
    recorder.take(world.sample(world.brick, 2, 0, {2, 1}));
    for (std::uint64_t i = 0; i < 100; ++i) {
      const auto now_ns = static_cast<core::Nanoseconds>(i) * 100 * core::kNsPerMillisecond;
      recorder.take(world.sample(world.state, 1 + i, now_ns));
      if (i == 20) recorder.take(world.sample(world.brick, 3, now_ns, {2, 2}));
      if (i == 50) recorder.take(world.sample(command, 1, now_ns));
      recorder.tick(now_ns);
    }
    recorder.finish(10 * FakeWorld::kSecond);
    for (const auto& [path, file] : world.files) opened.push_back({path, world.open(path)});
    EXPECT_EQ(opened.size(), 2u);
  }
  std::vector<Sent> run(const ReplayRequest& request) {
    NotedSink sink(clock);
    figures = replay(opened, request, sink, clock);
    starts = sink.starts;
    return sink.sent;
  }
  static std::vector<Sent> of(const std::vector<Sent>& sent, const std::string& topic) {
    std::vector<Sent> found;
    for (const Sent& s : sent) {
      if (s.topic == topic) found.push_back(s);
    }
    return found;
  }
  FakeWorld world;
  VirtualClock clock;
  std::vector<OpenedRecording> opened;
  ReplayFigures figures;
  std::vector<core::Nanoseconds> starts;
};

TEST_F(Replayed, EverySampleComesOnceAtItsTimeAcrossFiles) {
  const auto sent = run({});
  const auto states = of(sent, "state");
  ASSERT_EQ(states.size(), 100u);
  for (std::size_t i = 0; i < 100; ++i)
    EXPECT_EQ(states[i], (Sent{"state", static_cast<std::uint32_t>(1 + i),
                               static_cast<core::Nanoseconds>(i) * 100 * core::kNsPerMillisecond}));
  EXPECT_EQ(of(sent, "brick").size(), 3u) << "what the second file repeats is not sent again";
  EXPECT_TRUE(of(sent, "arm_command").empty()) << "nothing is commanded unasked";
  EXPECT_EQ(figures.samples, 103u);
}

TEST_F(Replayed, RateStretchesTimeAndZeroTakesNone) {
  ReplayRequest request;
  request.rate = 2;
  EXPECT_EQ(of(run(request), "state").back().at_ns, 4950 * core::kNsPerMillisecond);
  clock = {};
  request.rate = 0.25;
  EXPECT_EQ(of(run(request), "state").back().at_ns, 39'600 * core::kNsPerMillisecond);
  clock = {};
  request.rate = 0;
  EXPECT_EQ(of(run(request), "state").back().at_ns, 0);
}

TEST_F(Replayed, ARangeBeginsWithTheDurableStateThatHoldsThere) {
  ReplayRequest request;
  request.range = {3.0, 4.0};
  const auto sent = run(request);
  const auto states = of(sent, "state");
  ASSERT_EQ(states.size(), 10u);
  EXPECT_EQ(states.front(), (Sent{"state", 31, 0}));
  EXPECT_EQ(states.back(), (Sent{"state", 40, 900 * core::kNsPerMillisecond}));
  const auto bricks = of(sent, "brick");
  ASSERT_EQ(bricks.size(), 3u);
  for (const Sent& brick : bricks) EXPECT_EQ(brick.at_ns, 0) << "at once";
  EXPECT_EQ(bricks.back().number, 3u) << "the newest last";
  EXPECT_EQ(sent[2].topic, "brick") << "before all others";
}

TEST_F(Replayed, LoopsAreAsLongAsTheRange) {
  ReplayRequest request;
  request.loops = 3;
  request.range = {0.0, 2.0};
  const auto states = of(run(request), "state");
  EXPECT_EQ(states.size(), 60u);
  EXPECT_THAT(starts, ElementsAre(0, 2 * FakeWorld::kSecond, 4 * FakeWorld::kSecond));
  EXPECT_EQ(states[20].at_ns, 2 * FakeWorld::kSecond);
  request.loops = 0;
  clock = {};
  clock.end = clock.now + 100 * FakeWorld::kSecond;
  EXPECT_GT(run(request).size(), 900u) << "until it is told to end";
}

TEST_F(Replayed, ATopicFilterAndCommandsOnRequest) {
  ReplayRequest request;
  request.topics = {"brick", "arm_*"};
  EXPECT_TRUE(of(run(request), "state").empty());
  request.commands = true;
  clock = {};
  EXPECT_EQ(of(run(request), "arm_command").size(), 1u);
  request.topics = {"nothing"};
  clock = {};
  request.loops = 0;
  EXPECT_TRUE(run(request).empty()) << "and ends, though it was to loop for ever";
}

TEST_F(Replayed, TopicsGetTheirNewNamesAndKeepTypeAndQos) {
  ReplayRequest request;
  request.remap = {"state:=old_state"};
  const auto topics = topics_to_replay(opened, request);
  EXPECT_EQ(topics.at("state").name, "old_state");
  EXPECT_EQ(topics.at("state").type, "T");
  EXPECT_EQ(topics.at("brick").name, "brick");
  EXPECT_TRUE(topics.at("brick").durable);
  EXPECT_TRUE(topics.at("brick").keyed);
  EXPECT_FALSE(topics.at("state").durable);
}

TEST(ReplayRequests, WrongOnesAreNamed) {
  const auto problem = [](const ReplayRequest& request) -> std::string {
    try {
      validate(request);
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  ReplayRequest request;
  EXPECT_EQ(problem(request), "");
  request.remap = {"a=b"};
  EXPECT_THAT(problem(request), AllOf(HasSubstr("a=b"), HasSubstr("OLD:=NEW")));
  request.remap = {"a:=b", "a:=c"};
  EXPECT_THAT(problem(request), HasSubstr("has a new name already"));
  request.remap.clear();
  request.range = {5, 3};
  EXPECT_THAT(problem(request), HasSubstr("--until"));
}

TEST(RestamperOf, MovesStampsAndTheEchoesThatAnswerThemTogether) {
  Restamper restamper(99, 2.0);
  std::vector<std::uint8_t> bytes;
  const auto state = [&](std::uint64_t number, core::Nanoseconds at_ns, core::Nanoseconds due_ns) {
    msg::SlaveState sample;
    sample.stamp().sequence_number(number);
    sample.stamp().monotonic_ns(at_ns);
    sample.stamp().session(5);
    sample.clearance_m(0.5);
    const dds::CdrCodec codec(dds::kSlaveState);
    EXPECT_TRUE(codec.encode(&sample, bytes));
    EXPECT_TRUE(restamper.restamp(dds::kSlaveState, due_ns, bytes));
    EXPECT_TRUE(codec.decode(bytes, &sample));
    EXPECT_EQ(sample.clearance_m(), 0.5);
    return sample.stamp();
  };
  const auto echo = [&](std::uint64_t session, std::uint64_t number, core::Nanoseconds at_ns) {
    msg::DragField field;
    field.stamp().sequence_number(1);
    field.stamp().session(6);
    field.slave_echo().session(session);
    field.slave_echo().sequence_number(number);
    field.slave_echo().monotonic_ns(at_ns);
    const dds::CdrCodec codec(dds::kDragField);
    EXPECT_TRUE(codec.encode(&field, bytes));
    EXPECT_TRUE(restamper.restamp(dds::kDragField, 7000, bytes));
    EXPECT_TRUE(codec.decode(bytes, &field));
    return field.slave_echo();
  };
  restamper.begin(1000, 50'000);
  const auto first = state(10, 400'000, 2000), second = state(11, 402'000, 3000);
  EXPECT_EQ(first.monotonic_ns(), 2000) << "now";
  EXPECT_EQ(second.monotonic_ns(), 3000) << "2000 ns later, at twice the rate";
  EXPECT_EQ(first.utc_ns(), 51'000);
  EXPECT_EQ(first.sequence_number(), 10u);
  EXPECT_NE(first.session(), 5u);
  EXPECT_EQ(first.session(), second.session());
  const auto answer = echo(5, 11, 402'000);
  EXPECT_EQ(answer.session(), second.session());
  EXPECT_EQ(answer.sequence_number(), second.sequence_number());
  EXPECT_EQ(answer.monotonic_ns(), second.monotonic_ns());
  const auto stranger = echo(77, 3, 12);
  EXPECT_EQ(stranger.session(), 77u);
  EXPECT_EQ(stranger.monotonic_ns(), 12);
  restamper.begin(100'000, 150'000);  // the next turn
  const auto again = state(10, 400'000, 101'000);
  EXPECT_EQ(again.session(), first.session()) << "the same writer goes on";
  EXPECT_GT(again.sequence_number(), second.sequence_number());
  EXPECT_EQ(again.monotonic_ns(), 101'000);
}

TEST(RestamperOf, RemembersTheSessionsThatWereUsedLast) {
  Restamper restamper(99, 1.0);
  restamper.begin(0, 0);
  const auto moved = [&](std::uint64_t session, std::uint64_t number) {
    msg::Stamp stamp;
    stamp.session(session);
    stamp.sequence_number(number);
    restamper.move(stamp);
    return stamp.sequence_number();
  };
  EXPECT_EQ(moved(1, 10), 10u);
  for (std::uint64_t session = 2; session < 3 * Restamper::kMaxSessions; ++session) {
    moved(session, 1);
    if (session % 1000 == 0) moved(1, 10);
  }
  EXPECT_EQ(restamper.sessions(), Restamper::kMaxSessions);
  restamper.begin(1000, 0);
  restamper.begin(2000, 0);  // a turn in which it is silent
  EXPECT_EQ(moved(1, 10), 12u) << "one that was used goes on";
  EXPECT_EQ(moved(2, 10), 10u) << "one that was forgotten begins again";
}

TEST(RestamperOf, ClocksThatLeapFromEndToEndKeepTheirDirection) {
  constexpr auto kMin = std::numeric_limits<core::Nanoseconds>::min();
  constexpr auto kMax = std::numeric_limits<core::Nanoseconds>::max();
  for (const double rate : {0.01, 1.0, 100.0}) {
    Restamper restamper(99, rate);
    auto moved = [&restamper, number = 0U](core::Nanoseconds at_ns) mutable {
      msg::Stamp stamp;
      stamp.sequence_number(++number);
      stamp.session(5);
      stamp.monotonic_ns(at_ns);
      restamper.move(stamp);
      return stamp.monotonic_ns();
    };
    restamper.begin(1000, 1'800'000'000'000'000'000);
    EXPECT_EQ(moved(kMin), 1000);
    EXPECT_GT(moved(kMax), 1000);
    restamper.begin(2000, 1'800'000'000'000'000'000);
    EXPECT_EQ(moved(kMax), 2000);
    EXPECT_LT(moved(kMin), 2000);
  }
}

TEST(RestamperOf, LeavesTypesWithoutStampAndGarbageAlone) {
  Restamper restamper(1, 1.0);
  restamper.begin(0, 0);
  std::vector<std::uint8_t> bytes{0, 1, 0, 0, 1, 2, 3};
  const auto before = bytes;
  EXPECT_FALSE(restamper.restamp(dds::kWorkspaceBrick, 0, bytes));
  EXPECT_FALSE(restamper.restamp(dds::kPercept, 0, bytes));
  EXPECT_EQ(bytes, before);
}

}  // namespace
}  // namespace phantom::dds_recorder
