#include "common/can/sdo_client.hpp"

#include <algorithm>

namespace phantom::can {
namespace {

// Command specifiers: the upper three bits of an SDO's first byte (CiA 301, client / server).
constexpr std::uint8_t kDownloadSegment = 0, kInitiateDownload = 1, kInitiateUpload = 2, kUploadSegment = 3,
                       kAbort = 4;
constexpr std::uint8_t kUploadSegmentReply = 0, kDownloadSegmentReply = 1, kUploadReply = 2,
                       kDownloadReply = 3;

std::uint8_t specifier(const CanFrame& frame) noexcept {
  return static_cast<std::uint8_t>(frame.data[0] >> 5);
}

}  // namespace

void SdoClient::begin(bool read, std::uint16_t index, std::uint8_t sub, core::Nanoseconds now_ns) noexcept {
  state_ = State::kBusy;
  step_ = Step::kInitiate;
  read_ = read;
  toggle_ = false;
  index_ = index;
  sub_ = sub;
  abort_code_ = 0;
  done_ = 0;
  std::array<std::uint8_t, 8> data{};
  data[0] = static_cast<std::uint8_t>((read ? kInitiateUpload : kInitiateDownload) << 5);
  put_le(std::span(data).subspan(1), index, 2);
  data[3] = sub;
  if (!read) {
    if (size_ <= 4) {  // expedited: size indicated, data in the request itself
      data[0] = static_cast<std::uint8_t>(data[0] | 0x3 | (4 - size_) << 2);
      std::copy_n(buffer_.begin(), size_, data.begin() + 4);
    } else {
      data[0] |= 0x1;
      put_le(std::span(data).subspan(4), static_cast<std::uint32_t>(size_), 4);
    }
  }
  ask(data, now_ns);
}

void SdoClient::start_read(std::uint16_t index, std::uint8_t sub, core::Nanoseconds now_ns) noexcept {
  size_ = 0;
  begin(true, index, sub, now_ns);
}

void SdoClient::start_write(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> bytes,
                            core::Nanoseconds now_ns) noexcept {
  size_ = std::min(bytes.size(), kMaxBytes);
  std::copy_n(bytes.begin(), size_, buffer_.begin());
  begin(false, index, sub, now_ns);
}

void SdoClient::ask(const std::array<std::uint8_t, 8>& data, core::Nanoseconds now_ns) noexcept {
  outgoing_ = CanFrame{.id = kCobSdoRequest + node_, .length = 8, .data = data};
  due_ns_ = now_ns + timeout_ns_;
}

void SdoClient::ask_segment(core::Nanoseconds now_ns) noexcept {
  std::array<std::uint8_t, 8> data{};
  const auto toggle = static_cast<std::uint8_t>(toggle_ ? 0x10 : 0);
  if (read_) {
    data[0] = static_cast<std::uint8_t>(kUploadSegment << 5 | toggle);
  } else {
    const std::size_t part = std::min<std::size_t>(7, size_ - done_);
    const bool last = done_ + part == size_;
    data[0] = static_cast<std::uint8_t>(kDownloadSegment << 5 | toggle | (7 - part) << 1 | (last ? 1 : 0));
    std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(done_), part, data.begin() + 1);
    done_ += part;
  }
  ask(data, now_ns);
}

void SdoClient::abort(std::uint32_t code) noexcept {
  std::array<std::uint8_t, 8> data{};
  data[0] = kAbort << 5;
  put_le(std::span(data).subspan(1), index_, 2);
  data[3] = sub_;
  put_le(std::span(data).subspan(4), code, 4);
  outgoing_ = CanFrame{.id = kCobSdoRequest + node_, .length = 8, .data = data};
  abort_code_ = code;
  state_ = code == kAbortTimedOut ? State::kTimedOut : State::kAborted;
}

bool SdoClient::on_frame(const CanFrame& frame, core::Nanoseconds now_ns) noexcept {
  if (state_ != State::kBusy || frame.length != 8) return false;
  const bool names_object = step_ == Step::kInitiate || specifier(frame) == kAbort;
  const std::span bytes(frame.data);
  if (names_object && (get_le(bytes.subspan(1), 2) != index_ || frame.data[3] != sub_)) return false;
  if (specifier(frame) == kAbort) {
    abort_code_ = get_le(bytes.subspan(4), 4);
    state_ = State::kAborted;
    outgoing_.reset();
    return true;
  }
  if (step_ == Step::kInitiate)
    on_initiated(frame, now_ns);
  else
    on_segment(frame, now_ns);
  return true;
}

void SdoClient::on_initiated(const CanFrame& frame, core::Nanoseconds now_ns) noexcept {
  if (specifier(frame) != (read_ ? kUploadReply : kDownloadReply)) return abort(kAbortUnknownCommand);
  const bool expedited = (frame.data[0] & 0x2) != 0, sized = (frame.data[0] & 0x1) != 0;
  if (read_ && expedited) {
    size_ = sized ? 4U - (frame.data[0] >> 2 & 0x3U) : 4U;
    std::copy_n(frame.data.begin() + 4, size_, buffer_.begin());
    state_ = State::kDone;
  } else if (!read_ && size_ <= 4) {
    state_ = State::kDone;
  } else {
    step_ = Step::kSegments;
    ask_segment(now_ns);
  }
}

void SdoClient::on_segment(const CanFrame& frame, core::Nanoseconds now_ns) noexcept {
  if (specifier(frame) != (read_ ? kUploadSegmentReply : kDownloadSegmentReply))
    return abort(kAbortUnknownCommand);
  if (((frame.data[0] & 0x10) != 0) != toggle_) return abort(kAbortToggle);
  toggle_ = !toggle_;
  if (read_) on_read_segment(frame);
  if (!read_ && done_ == size_) state_ = State::kDone;
  if (state_ == State::kBusy) ask_segment(now_ns);
}

void SdoClient::on_read_segment(const CanFrame& frame) noexcept {
  const std::size_t part = 7U - (frame.data[0] >> 1 & 0x7U);
  if (size_ + part > kMaxBytes) return abort(kAbortOutOfMemory);
  std::copy_n(frame.data.begin() + 1, part, buffer_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += part;
  if (frame.data[0] & 0x1) state_ = State::kDone;
}

std::optional<CanFrame> SdoClient::poll(core::Nanoseconds now_ns) noexcept {
  if (state_ == State::kBusy && now_ns >= due_ns_) abort(kAbortTimedOut);
  std::optional<CanFrame> frame;
  outgoing_.swap(frame);
  return frame;
}

}  // namespace phantom::can
