#pragma once

#include <memory>
#include <optional>

#include "common/core/network.hpp"
#include "components/phantom_sensing/contact_register.hpp"

namespace phantom::phantom_sensing {

/// A request to a running phantom_sensing (idl SensingCommand).
struct SensingRequest {
  enum class What { kContact, kListContacts, kSelfTest };
  What what = What::kSelfTest;
  ContactRequest contact;  ///< used with kContact only
};

/// A client of phantom_sensing: sends sensing_command and waits for sensing_reply. One thread.
class CommandClient {
 public:
  /// Joins the DDS domain. Throws dds::DdsError.
  explicit CommandClient(const core::NetworkOptions& network);
  ~CommandClient();

  /// Sends the request repeatedly until it is answered. Returns nothing if no answer comes within
  /// `timeout_s`. Throws core::ConfigError for a name that is too long for the topic.
  std::optional<Answer> ask(const SensingRequest& request, double timeout_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::phantom_sensing
