#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "common/core/clock.hpp"
#include "common/dds/admission/guid_prefix.hpp"
#include "common/dds/endpoints/participant.hpp"
#include "common/dds/endpoints/topics.hpp"

namespace phantom::dds {

/// Returns the GUID prefix of `participant`, as SampleInfo gives it.
GuidPrefix prefix_of(const Participant& participant);

/// What is known about a received sample besides its content.
struct SampleInfo {
  core::Nanoseconds received_ns = 0;  ///< CLOCK_MONOTONIC of this host when the sample was taken
  GuidPrefix writer{};                ///< participant that wrote it
  std::string_view model_label;       ///< of its writer; valid during the callback; empty: it has none
};

/// Global identifier of an endpoint or a participant: prefix and entity (OMG DDSI-RTPS 2.3, 8.2.4.1).
using Guid = std::array<std::uint8_t, 16>;
Guid guid_of(const Participant& participant);

/// Untyped endpoints; use Writer<T> and Reader<T>.
class RawWriter {
 public:
  RawWriter(Participant& participant, const TopicDescription& topic);
  ~RawWriter();
  RawWriter(RawWriter&&) noexcept;
  bool write(void* sample);
  std::uint32_t matched() const;
  Guid guid() const;
  /// Asserts MANUAL_BY_TOPIC liveliness without sending a sample.
  void assert_liveliness();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

class RawReader {
 public:
  using OnSample = std::function<bool(const void*, const SampleInfo&)>;
  using OnWriterGone = std::function<void(const GuidPrefix&)>;
  RawReader(Participant& participant, const TopicDescription& topic, OnSample on_sample,
            OnWriterGone on_writer_gone = {});
  ~RawReader();
  RawReader(RawReader&&) noexcept;
  /// Counts a sample that was refused after its callback had returned. Thread-safe.
  void count_refused();
  std::uint32_t matched() const;
  Guid guid() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Publishes T on its topic. write() may block for tens of milliseconds while a reader joins: never call it
/// from a servo thread. Thread-safe.
template <class T>
class Writer {
 public:
  /// Throws DdsError if the QoS profile is missing or contradicts the contract.
  Writer(Participant& participant, const TopicSpec<T>& topic) : raw_(participant, topic) {}
  /// Returns false if the sample could not be queued.
  bool write(const T& sample) { return raw_.write(const_cast<T*>(&sample)); }
  std::uint32_t matched() const { return raw_.matched(); }
  Guid guid() const { return raw_.guid(); }
  void assert_liveliness() { raw_.assert_liveliness(); }

 private:
  RawWriter raw_;
};

/// Receives T. `on_sample` runs on a middleware thread, one sample at a time: copy what you need
/// (core::Snapshot, a queue) and return; do not block, do not throw. It may return whether the sample was
/// accepted; a sample that was not is counted (shown as `refused`). `on_writer_gone` runs likewise when a
/// participant's writer of this topic has ended, or has not been heard for its lease.
template <class T>
class Reader {
 public:
  using OnSample = std::function<void(const T&, const SampleInfo&)>;
  using OnWriterGone = RawReader::OnWriterGone;
  template <class Callback>
  Reader(Participant& participant, const TopicSpec<T>& topic, Callback on_sample,
         OnWriterGone on_writer_gone = {})
      : raw_(
            participant, topic,
            [callback = std::move(on_sample)](const void* data, const SampleInfo& info) mutable {
              const T& sample = *static_cast<const T*>(data);
              if constexpr (std::is_same_v<decltype(callback(sample, info)), bool>) {
                return callback(sample, info);
              } else {
                callback(sample, info);
                return true;
              }
            },
            std::move(on_writer_gone)) {}
  void count_refused() { raw_.count_refused(); }
  std::uint32_t matched() const { return raw_.matched(); }
  Guid guid() const { return raw_.guid(); }

 private:
  RawReader raw_;
};

}  // namespace phantom::dds
