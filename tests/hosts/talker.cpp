// A participant that sends and hears periodic, reliable and durable samples all the time, to see who
// hears whom after processes were killed or stood still. Prints its session, then for each line that it reads
// what it has heard since its start: {"longest_write_ms": …, "heard": {topic: {session: samples}}}.
#include <atomic>
#include <iostream>
#include <map>
#include <mutex>
#include <thread>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"

namespace {

using namespace phantom;

constexpr std::chrono::milliseconds kPeriod{5};
constexpr int kCommandTicks = 10, kStatusTicks = 100;

class Received {
 public:
  void count(const char* topic, std::uint64_t session) {
    const std::lock_guard lock(mutex_);
    ++samples_[topic][session];
  }
  void print(double longest_write_ms) {
    const std::lock_guard lock(mutex_);
    std::cout << "{\"longest_write_ms\": " << longest_write_ms << ", \"heard\": {";
    const char* next_topic = "";
    for (const auto& [topic, sessions] : samples_) {
      std::cout << next_topic << '"' << topic << "\": {";
      const char* next = "";
      for (const auto& [session, samples] : sessions) {
        std::cout << next << '"' << session << "\": " << samples;
        next = ", ";
      }
      std::cout << '}';
      next_topic = ", ";
    }
    std::cout << "}}" << std::endl;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::map<std::uint64_t, std::uint64_t>> samples_;
};

// Its writers, and what they send. One thread.
class Talk {
 public:
  Talk(dds::Participant& participant)
      : stamper_(participant),
        state_(participant, dds::kMasterState),
        command_(participant, dds::kOperatorCommand),
        status_(participant, dds::kComponentStatus) {
    own_status_.component_name(participant.component());
    own_status_.host(participant.component());
  }
  void tick() {
    send(state_, own_state_);
    if (ticks_ % kCommandTicks == 0) send(command_, own_command_);
    if (ticks_ % kStatusTicks == 0) send(status_, own_status_);
    ++ticks_;
  }
  double longest_write_ms() const { return longest_write_ns_ * 1e-6; }

 private:
  template <class T>
  void send(dds::Writer<T>& writer, T& sample) {
    sample.stamp(stamper_.next());
    const core::Nanoseconds begun_ns = core::monotonic_ns();
    writer.write(sample);
    longest_write_ns_ =
        std::max(longest_write_ns_.load(), static_cast<double>(core::monotonic_ns() - begun_ns));
  }

  dds::Stamper stamper_;
  dds::Writer<msg::MasterState> state_;
  dds::Writer<msg::OperatorCommand> command_;
  dds::Writer<msg::ComponentStatus> status_;
  msg::MasterState own_state_;
  msg::OperatorCommand own_command_;
  msg::ComponentStatus own_status_;
  int ticks_ = 0;
  std::atomic<double> longest_write_ns_{0.0};
};

template <class T>
dds::Reader<T> read_counting(dds::Participant& participant, const dds::TopicSpec<T>& topic,
                             Received& received, std::chrono::microseconds work) {
  return dds::Reader<T>(participant, topic,
                        [&received, work, name = topic.name](const T& sample, const dds::SampleInfo&) {
                          received.count(name, sample.stamp().session());
                          const auto end = std::chrono::steady_clock::now() + work;
                          while (std::chrono::steady_clock::now() < end) continue;
                        });
}

}  // namespace

int main(int argc, char** argv) {
  std::string name;
  int work_us = 0;
  runtime::ProcessDescription description;
  description.name = "talker";
  description.summary = "A participant that sends and hears all the time, for killing and freezing it.";
  description.add_options = [&](runtime::Command app) {
    app.option("--as", name, "that it has in the domain").required();
    app.option("--work-us", work_us, "that each sample keeps its reader busy");
  };
  description.run = [&](const runtime::ProcessOptions& options) {
    const auto deployment = runtime::load_deployment(options);
    Received received;
    dds::Participant participant(name, deployment.network);
    const std::chrono::microseconds work(work_us);
    const auto states = read_counting(participant, dds::kMasterState, received, work);
    const auto commands = read_counting(participant, dds::kOperatorCommand, received, work);
    const auto statuses = read_counting(participant, dds::kComponentStatus, received, work);
    Talk talk(participant);
    std::atomic<bool> stop{false};
    std::thread talking([&] {
      for (; !stop; std::this_thread::sleep_for(kPeriod)) talk.tick();
    });
    std::cout << participant.session() << std::endl;
    for (std::string line; std::getline(std::cin, line);) received.print(talk.longest_write_ms());
    stop = true;
    talking.join();
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
