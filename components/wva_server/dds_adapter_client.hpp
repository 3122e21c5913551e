#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/messages/workspace.hpp"

namespace phantom::wva_server {

/// The cell and the objects that a running wva_server serves.
struct Listing {
  std::string cell;
  std::uint64_t version = 0;
  std::uint32_t bricks = 0;
  std::vector<messages::WorkspaceObject> objects;
  std::vector<messages::CarriedObject> carried;  ///< which of them arms carry
};

/// Returns what is served, once all of it has been received; none if that takes longer than `timeout_s`.
/// Throws dds::DdsError.
std::optional<Listing> list_objects(const core::NetworkOptions& network, double timeout_s);

}  // namespace phantom::wva_server
