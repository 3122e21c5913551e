#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "common/can/canopen.hpp"

namespace phantom::can {

/// Reads and writes the object dictionary of one node, one object at a time, expedited or segmented (CiA
/// 301).
///
/// It uses no bus: frames from the node go to on_frame(), and poll() returns the frames to send. Nothing
/// allocates memory. Real-time safe: yes, all of it.
class SdoClient {
 public:
  static constexpr std::size_t kMaxBytes = 256;
  enum class State : std::uint8_t { kIdle, kBusy, kDone, kAborted, kTimedOut };

  SdoClient(std::uint8_t node, core::Nanoseconds timeout_ns) : node_(node), timeout_ns_(timeout_ns) {}

  /// Begins a transfer and discards an earlier one. `bytes`: 1…kMaxBytes.
  void start_read(std::uint16_t index, std::uint8_t sub, core::Nanoseconds now_ns) noexcept;
  void start_write(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> bytes,
                   core::Nanoseconds now_ns) noexcept;

  /// Processes an answer of the node (its 0x580 + node). Returns false if none was expected: another client
  /// sends requests, or another server answers.
  bool on_frame(const CanFrame& frame, core::Nanoseconds now_ns) noexcept;
  /// Returns the frame to send now, if any, and checks the timeout.
  std::optional<CanFrame> poll(core::Nanoseconds now_ns) noexcept;

  State state() const noexcept { return state_; }
  std::uint32_t abort_code() const noexcept { return abort_code_; }
  /// Returns the bytes that were read, once done.
  std::span<const std::uint8_t> data() const noexcept { return {buffer_.data(), size_}; }

 private:
  enum class Step : std::uint8_t { kInitiate, kSegments };
  void begin(bool read, std::uint16_t index, std::uint8_t sub, core::Nanoseconds now_ns) noexcept;
  void ask(const std::array<std::uint8_t, 8>& data, core::Nanoseconds now_ns) noexcept;
  void ask_segment(core::Nanoseconds now_ns) noexcept;
  void abort(std::uint32_t code) noexcept;
  void on_initiated(const CanFrame& frame, core::Nanoseconds now_ns) noexcept;
  void on_segment(const CanFrame& frame, core::Nanoseconds now_ns) noexcept;
  void on_read_segment(const CanFrame& frame) noexcept;

  std::uint8_t node_;
  core::Nanoseconds timeout_ns_;
  State state_ = State::kIdle;
  Step step_ = Step::kInitiate;
  bool read_ = false, toggle_ = false;
  std::uint16_t index_ = 0;
  std::uint8_t sub_ = 0;
  std::uint32_t abort_code_ = 0;
  core::Nanoseconds due_ns_ = 0;
  std::array<std::uint8_t, kMaxBytes> buffer_{};
  std::size_t size_ = 0, done_ = 0;
  std::optional<CanFrame> outgoing_;
};

}  // namespace phantom::can
