#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "components/simulated_drive/object_dictionary.hpp"

namespace phantom::simulated_drive {

/// Serves an object dictionary by SDO: expedited and segmented, in both directions (CiA 301).
class SdoServer {
 public:
  using Message = std::array<std::uint8_t, 8>;
  using Write = std::function<AbortCode(std::uint16_t, std::uint8_t, const std::vector<std::uint8_t>&)>;

  SdoServer(const ObjectDictionary& dictionary, Write write)
      : dictionary_(dictionary), write_(std::move(write)) {}

  /// Returns the answer to a request; none to an abort.
  std::optional<Message> answer(const Message& request);
  void forget() { transfer_ = Transfer::kNone; }

 private:
  enum class Transfer { kNone, kToClient, kFromClient };
  Message begin_download(const Message& request);
  Message begin_upload(const Message& request);
  Message take_segment(const Message& request);
  Message give_segment(const Message& request);
  Message refuse(std::uint32_t code);

  const ObjectDictionary& dictionary_;
  Write write_;
  Transfer transfer_ = Transfer::kNone;
  std::uint16_t index_ = 0;
  std::uint8_t sub_ = 0;
  bool odd_ = false;
  std::vector<std::uint8_t> bytes_;
  std::size_t given_ = 0, announced_ = 0;
};

}  // namespace phantom::simulated_drive
