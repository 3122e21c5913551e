#pragma once

#include <memory>
#include <optional>

#include "common/core/network.hpp"
#include "components/phantom_sensing/contact_register.hpp"

namespace phantom::phantom_sensing {

/// What a running phantom_sensing can be asked for (idl SensingCommand).
struct SensingRequest {
  enum class What { kContact, kListContacts, kSelfTest };
  What what = What::kSelfTest;
  ContactRequest contact;  ///< with kContact
};

/// The other end of sensing_command: for who asks for something. One thread.
class CommandClient {
 public:
  /// Joins the data space. Throws dds::DdsError.
  explicit CommandClient(const core::NetworkOptions& network);
  ~CommandClient();

  /// Sends the request, again and again until it is answered. None if there was no answer for `timeout_s`.
  /// Throws core::ConfigError for a name that does not fit the topic.
  std::optional<Answer> ask(const SensingRequest& request, double timeout_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::phantom_sensing
