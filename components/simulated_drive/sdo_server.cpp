#include "components/simulated_drive/sdo_server.hpp"

#include <algorithm>

namespace phantom::simulated_drive {

SdoServer::Message SdoServer::refuse(std::uint32_t code) {
  transfer_ = Transfer::kNone;
  return {0x80,
          static_cast<std::uint8_t>(index_ % 256),
          static_cast<std::uint8_t>(index_ / 256),
          sub_,
          static_cast<std::uint8_t>(code),
          static_cast<std::uint8_t>(code >> 8),
          static_cast<std::uint8_t>(code >> 16),
          static_cast<std::uint8_t>(code >> 24)};
}

std::optional<SdoServer::Message> SdoServer::answer(const Message& request) {
  switch (request[0] & 0xE0) {
    case 0x20:
      return begin_download(request);
    case 0x40:
      return begin_upload(request);
    case 0x00:
      return take_segment(request);
    case 0x60:
      return give_segment(request);
    case 0x80:
      forget();
      return std::nullopt;
    default:
      return refuse(0x05040001);
  }
}

SdoServer::Message SdoServer::begin_download(const Message& request) {
  index_ = static_cast<std::uint16_t>(request[1] + 256 * request[2]);
  sub_ = request[3];
  const bool expedited = request[0] & 2, counted = request[0] & 1;
  const Message accepted{0x60, request[1], request[2], request[3]};
  if (expedited) {
    const std::size_t size = counted ? 4 - ((request[0] & 0x0C) / 4) : 4;
    const AbortCode code =
        write_(index_, sub_, {request.begin() + 4, request.begin() + 4 + static_cast<long>(size)});
    return code == kNoAbort ? accepted : refuse(code);
  }
  const auto* object = dictionary_.find(index_, sub_);
  if (object == nullptr) return refuse(dictionary_.missing(index_));
  if (!object->writable) return refuse(kAbortReadOnly);
  transfer_ = Transfer::kFromClient;
  announced_ = counted ? static_cast<std::size_t>(request[4] + 256 * request[5]) : 0;
  bytes_.clear();
  odd_ = false;
  return accepted;
}

SdoServer::Message SdoServer::begin_upload(const Message& request) {
  index_ = static_cast<std::uint16_t>(request[1] + 256 * request[2]);
  sub_ = request[3];
  const auto* object = dictionary_.find(index_, sub_);
  if (object == nullptr) return refuse(dictionary_.missing(index_));
  const std::size_t size = object->bytes.size();
  Message reply{0x41, request[1], request[2], request[3]};
  if (size >= 1 && size <= 4) {
    reply[0] = static_cast<std::uint8_t>(0x43 + 4 * (4 - size));
    std::copy(object->bytes.begin(), object->bytes.end(), reply.begin() + 4);
    return reply;
  }
  transfer_ = Transfer::kToClient;
  bytes_ = object->bytes;
  given_ = 0;
  odd_ = false;
  reply[4] = static_cast<std::uint8_t>(size % 256);
  reply[5] = static_cast<std::uint8_t>(size / 256);
  return reply;
}

SdoServer::Message SdoServer::take_segment(const Message& request) {
  if (transfer_ != Transfer::kFromClient) return refuse(0x05040001);
  if (static_cast<bool>(request[0] & 0x10) != odd_) return refuse(0x05030000);
  const std::size_t used = 7 - ((request[0] & 0x0E) / 2);
  bytes_.insert(bytes_.end(), request.begin() + 1, request.begin() + 1 + static_cast<long>(used));
  const Message reply{static_cast<std::uint8_t>(odd_ ? 0x30 : 0x20)};
  odd_ = !odd_;
  if (bytes_.size() > 4096) return refuse(kAbortWrongLength);
  if ((request[0] & 1) == 0) return reply;
  transfer_ = Transfer::kNone;
  if (announced_ != 0 && announced_ != bytes_.size()) return refuse(kAbortWrongLength);
  const AbortCode code = write_(index_, sub_, bytes_);
  return code == kNoAbort ? reply : refuse(code);
}

SdoServer::Message SdoServer::give_segment(const Message& request) {
  if (transfer_ != Transfer::kToClient) return refuse(0x05040001);
  if (static_cast<bool>(request[0] & 0x10) != odd_) return refuse(0x05030000);
  const std::size_t part = std::min<std::size_t>(7, bytes_.size() - given_);
  Message reply{};
  std::copy_n(bytes_.begin() + static_cast<long>(given_), part, reply.begin() + 1);
  given_ += part;
  const bool last = given_ == bytes_.size();
  reply[0] = static_cast<std::uint8_t>((odd_ ? 0x10 : 0) + 2 * (7 - part) + (last ? 1 : 0));
  odd_ = !odd_;
  if (last) transfer_ = Transfer::kNone;
  return reply;
}

}  // namespace phantom::simulated_drive
