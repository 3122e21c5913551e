#pragma once

#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/clock.hpp"
#include "common/runtime/configuration/role_secrets.hpp"

namespace phantom::web {

using runtime::Role;

/// The sessions of those who have logged in on the page. Time comes in. Thread-safe.
class PageSessions {
 public:
  static constexpr std::size_t kMax = 64;
  static constexpr core::Nanoseconds kLife_ns = 12LL * 3600 * core::kNsPerSecond;

  struct Opened {
    std::string token;  ///< 128 random bits in hexadecimal
    Role role = Role::kWatch;
  };

  /// `secrets`: none, and nobody can log in.
  explicit PageSessions(std::optional<runtime::RoleSecrets> secrets) : secrets_(std::move(secrets)) {}

  /// Returns whether roles are told apart at all.
  bool needed() const { return secrets_.has_value(); }
  /// Opens a session for who knows a role's secret. The oldest ends where there are too many.
  std::optional<Opened> open(std::string_view secret, core::Nanoseconds now_ns);
  /// Returns the role of a session that has neither ended nor expired.
  std::optional<Role> role_of(std::string_view token, core::Nanoseconds now_ns);
  void close(std::string_view token);

 private:
  struct Session {
    Opened opened;
    core::Nanoseconds ends_ns = 0;
  };
  const std::optional<runtime::RoleSecrets> secrets_;
  std::mutex mutex_;
  std::list<Session> sessions_;  ///< the oldest first
};

/// Returns the value of a cookie in a Cookie header; empty: there is none.
std::string cookie_of(std::string_view header, std::string_view name);

}  // namespace phantom::web
