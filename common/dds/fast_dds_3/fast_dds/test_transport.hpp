#pragma once

// What tests use to lose messages, and to see where they go.

#include <chrono>
#include <fastdds/rtps/common/CDRMessage_t.hpp>
#include <fastdds/rtps/transport/test_UDPv4TransportDescriptor.hpp>
#include <vector>

#include "fast_dds/transport.hpp"

namespace phantom::fast_dds {

/// A socket that keeps where messages went.
class KeepingSender : public rtps::SenderResource {
 public:
  std::vector<rtps::Locator_t> reached;

  KeepingSender() : SenderResource(LOCATOR_KIND_UDPv4) {
    clean_up = [] {};
    send_buffers_lambda_ = [this](const std::vector<rtps::NetworkBuffer>&, std::uint32_t,
                                  rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
                                  const std::chrono::steady_clock::time_point&) {
      for (; *begin != *end; ++*begin) reached.push_back(**begin);
      return true;
    };
  }
};

}  // namespace phantom::fast_dds
