#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "common/core/sample_id.hpp"
#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {

/// A command as received, with its sender.
struct Request {
  core::SampleId id;  ///< the command's stamp, which identifies it
  std::string requester;
  CellCommand command;
};

enum class Outcome { kAccepted, kDone, kRefused };

/// The answer to a command, for its requester.
struct Reply {
  Outcome outcome = Outcome::kAccepted;
  std::string message;
  std::uint16_t object_id = 0;
  std::string object;
  std::uint64_t version = 0;
  std::size_t changed_bricks = 0, removed_bricks = 0;
  double seconds = 0.0;
};

}  // namespace phantom::wva_server
