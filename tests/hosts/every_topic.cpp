// Sends a sample of every topic, and many large bricks of a workspace, or receives them. The sender writes
// what is durable once, at its start, and the rest again and again. Prints "up" when all is written or
// awaited, then for each line that it reads one line: {"cdr": {topic: octets in hexadecimal}, "samples":
// {topic: number}, "bricks": number}. Sender and receiver serialise each sample themselves.
#include <atomic>
#include <iostream>
#include <list>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <thread>

#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"
#include "tests/support/topic_samples.hpp"

namespace {

using namespace phantom;

constexpr int kBricks = 200;
constexpr std::size_t kBrickBytes = 30'000;  // several fragments
constexpr std::chrono::milliseconds kPeriod{100};

class Tally {
 public:
  void add(const dds::TopicDescription& topic, const std::vector<std::uint8_t>& cdr) {
    constexpr const char* kDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t octet : cdr) text.append({kDigits[octet >> 4], kDigits[octet & 15]});
    const std::lock_guard lock(mutex_);
    cdr_[topic.name] = std::move(text);
    ++samples_[topic.name];
  }
  void add_brick(std::int32_t x) {
    const std::lock_guard lock(mutex_);
    bricks_.insert(x);
  }
  void print() {
    const std::lock_guard lock(mutex_);
    const auto members = [](const auto& map, const char* quote) {
      const char* next = "";
      for (const auto& [name, value] : map) {
        std::cout << next << '"' << name << "\": " << quote << value << quote;
        next = ", ";
      }
    };
    std::cout << "{\"cdr\": {";
    members(cdr_, "\"");
    std::cout << "}, \"samples\": {";
    members(samples_, "");
    std::cout << "}, \"bricks\": " << bricks_.size() << '}' << std::endl;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::string> cdr_;
  std::map<std::string, int> samples_;
  std::set<std::int32_t> bricks_;
};

/// A brick of the test's own, whose content follows from its place.
msg::WorkspaceBrick large_brick(std::int32_t x) {
  std::mt19937 random(static_cast<std::uint32_t>(x));
  std::vector<std::uint8_t> content(kBrickBytes);
  for (std::uint8_t& octet : content) octet = static_cast<std::uint8_t>(random());
  msg::WorkspaceBrick brick;
  brick.bx(x);
  brick.by(kBricks);
  brick.voxels_zstd(content);
  return brick;
}

bool is_durable(const dds::TopicDescription& topic) {
  return topic.qos.durability == dds::Durability::kTransientLocal;
}

void answer(Tally& tally) {
  std::cout << "up" << std::endl;
  for (std::string line; std::getline(std::cin, line);) tally.print();
}

/// A topic's writer and its sample, serialised.
struct Sent {
  Sent(dds::Participant& participant, const dds::TopicDescription& description)
      : topic(description), writer(participant, description), codec(description) {
    test::with_sample(topic, [&](void* sample) { codec.encode(sample, cdr); });
  }
  void write() {
    test::with_sample(topic, [&](void* sample) {
      if (codec.decode(cdr, sample)) writer.write(sample);
    });
  }
  const dds::TopicDescription& topic;
  dds::RawWriter writer;
  dds::CdrCodec codec;
  std::vector<std::uint8_t> cdr;
};

void send(dds::Participant& participant) {
  Tally tally;
  std::list<Sent> all;
  for (const dds::TopicDescription* topic : dds::all_topics()) all.emplace_back(participant, *topic);
  const auto write = [&](bool durable) {
    for (Sent& each : all) {
      if (is_durable(each.topic) != durable) continue;
      each.write();
      tally.add(each.topic, each.cdr);
    }
  };
  write(true);
  write(false);
  for (Sent& each : all) {
    if (&each.topic != &dds::kWorkspaceBrick) continue;
    for (std::int32_t x = 0; x < kBricks; ++x) {
      msg::WorkspaceBrick brick = large_brick(x);
      each.writer.write(&brick);
      tally.add_brick(x);
    }
  }
  std::atomic<bool> stop{false};
  std::thread sending([&] {
    for (; !stop; std::this_thread::sleep_for(kPeriod)) write(false);
  });
  answer(tally);
  stop = true;
  sending.join();
}

void receive(dds::Participant& participant) {
  Tally tally;
  std::list<dds::CdrCodec> codecs;
  std::list<dds::RawReader> readers;
  for (const dds::TopicDescription* topic : dds::all_topics()) {
    dds::CdrCodec& codec = codecs.emplace_back(*topic);
    readers.emplace_back(participant, *topic, [&, topic](const void* sample, const dds::SampleInfo&) {
      if (topic == &dds::kWorkspaceBrick) {
        const auto& brick = *static_cast<const msg::WorkspaceBrick*>(sample);
        if (brick.by() == kBricks) {
          if (brick.voxels_zstd() != large_brick(brick.bx()).voxels_zstd()) return false;
          tally.add_brick(brick.bx());
          return true;
        }
      }
      std::vector<std::uint8_t> cdr;
      if (!codec.encode(sample, cdr)) return false;
      tally.add(*topic, cdr);
      return true;
    });
  }
  answer(tally);
}

}  // namespace

int main(int argc, char** argv) {
  std::string what;
  runtime::ProcessDescription description;
  description.name = "every_topic";
  description.summary = "Sends or receives a sample of every topic.";
  description.add_options = [&](runtime::Command app) {
    app.option("--what", what, "send or receive").required();
  };
  description.run = [&](const runtime::ProcessOptions& options) {
    const auto deployment = runtime::load_deployment(options);
    dds::Participant participant(what, deployment.network);
    what == "send" ? send(participant) : receive(participant);
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
