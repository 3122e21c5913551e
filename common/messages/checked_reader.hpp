#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>

#include "common/dds/endpoint.hpp"
#include "common/dds/refusal_log.hpp"
#include "common/dds/source_guard.hpp"
#include "common/messages/arm_bounds.hpp"

namespace phantom::messages {

/// Receives a topic that one process writes at a time, and hands on the samples that are sound by the topic's
/// codec, newer than the last, and of the process that is followed (dds::SourceGuard). The others are counted
/// and told in the log, at most once in a while. Include the topic's codec, too.
template <class Message>
class CheckedReader {
 public:
  using Sample = std::remove_cvref_t<decltype(*from_idl(std::declval<const Message&>(), ArmBounds()))>;
  using OnSample = std::function<void(const Sample&, core::Nanoseconds received_ns)>;
  /// Why a sound sample is of no use to this receiver; empty if it is.
  using Refusal = std::function<std::string(const Sample&)>;

  /// `arm`: that samples must be about. Callbacks run on the middleware's thread, as dds::Reader's. Throws
  /// dds::DdsError.
  CheckedReader(dds::Participant& participant, const dds::TopicSpec<Message>& topic, ArmBounds arm,
                OnSample on_sample, Refusal refusal = {})
      : arm_(std::move(arm)),
        on_sample_(std::move(on_sample)),
        refusal_(std::move(refusal)),
        refusals_(topic.name),
        reader_(participant, topic,
                [this](const Message& message, const dds::SampleInfo& info) { take(message, info); }) {
    ready_ = true;
  }

  /// Whether another process writes the topic, too. Thread-safe.
  bool has_rival(core::Nanoseconds now_ns) const noexcept { return source_.has_rival(now_ns); }

 private:
  void take(const Message& message, const dds::SampleInfo& info) {
    const auto sample = from_idl(message, arm_);
    std::string why = sample.status().message();
    if (sample && refusal_) why = refusal_(*sample);
    if (why.empty()) {
      const char* reason = dds::reason(source_.assess(message.stamp(), info.received_ns));
      if (reason == nullptr) return on_sample_(*sample, info.received_ns);
      why = reason;
    }
    if (ready_) reader_.count_refused();
    refusals_.refused(why, info.received_ns);
  }

  ArmBounds arm_;
  OnSample on_sample_;
  Refusal refusal_;
  dds::SourceGuard source_;
  dds::RefusalLog refusals_;
  std::atomic<bool> ready_{false};  // samples may come while reader_ is still being made
  dds::Reader<Message> reader_;
};

}  // namespace phantom::messages
