#include "common/web/page_sessions.hpp"

#include <algorithm>

namespace phantom::web {
namespace {

constexpr std::size_t kTokenOctets = 16;

}  // namespace

std::optional<PageSessions::Opened> PageSessions::open(std::string_view secret, core::Nanoseconds now_ns) {
  const auto role = secrets_ ? secrets_->role_of(secret) : std::nullopt;
  if (!role) return std::nullopt;
  Opened opened{runtime::random_hex(kTokenOctets), *role};
  const std::lock_guard lock(mutex_);
  if (sessions_.size() == kMax) sessions_.pop_front();
  sessions_.push_back({opened, now_ns + kLife_ns});
  return opened;
}

std::optional<Role> PageSessions::role_of(std::string_view token, core::Nanoseconds now_ns) {
  const std::lock_guard lock(mutex_);
  std::erase_if(sessions_, [&](const Session& session) { return session.ends_ns <= now_ns; });
  for (const Session& session : sessions_)
    if (runtime::same_secret(session.opened.token, token)) return session.opened.role;
  return std::nullopt;
}

void PageSessions::close(std::string_view token) {
  const std::lock_guard lock(mutex_);
  std::erase_if(sessions_, [&](const Session& session) { return session.opened.token == token; });
}

std::string cookie_of(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const std::string_view pair = header.substr(0, header.find(';'));
    header.remove_prefix(std::min(pair.size() + 1, header.size()));
    const auto begin = std::min(pair.find_first_not_of(' '), pair.size());
    const auto equals = pair.find('=');
    if (equals != std::string_view::npos && equals >= begin && pair.substr(begin, equals - begin) == name)
      return std::string(pair.substr(equals + 1));
  }
  return "";
}

}  // namespace phantom::web
