#pragma once

#include <httplib.h>
#undef _res  // a macro of resolv.h, which httplib.h includes: a name of Eigen's

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace phantom::workspace_survey {

/// A client of the survey's page.
class PageClient {
 public:
  explicit PageClient(const std::string& url)
      : port_(std::stoi(url.substr(url.rfind(':') + 1))), client_("127.0.0.1", port_) {
    key_ = url.substr(url.find('/', 8));
    key_.pop_back();
    client_.set_read_timeout(20);
  }
  int port() const { return port_; }
  /// "/" and the key.
  const std::string& key() const { return key_; }

  int status_of(const std::string& path, const httplib::Headers& headers = {}) {
    const auto got = client_.Get(path, headers);
    return got ? got->status : 0;
  }
  int post_to(const std::string& path, const std::string& body, const httplib::Headers& headers,
              const char* type) {
    const auto got = client_.Post(path, headers, body, type);
    answer_ = got ? got->body : httplib::to_string(got.error());
    return got ? got->status : 0;
  }
  int post(const std::string& body) { return post_to(key_ + "/line", body, {}, "application/json"); }
  int send(const std::string& line) {
    const int status = post(nlohmann::json{{"line", line}}.dump());
    if (status == 200) state_["busy"] = true;  // until a state says otherwise
    return status;
  }
  /// Returns what the last answer says to a person.
  std::string message() const { return nlohmann::json::parse(answer_).value("message", ""); }

  /// Follows the state until it is as wanted, for 20 s at most. Returns whether it was.
  bool wait_for(const std::function<bool(const nlohmann::json&)>& wanted) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!wanted(state_)) {
      if (std::chrono::steady_clock::now() > end) return false;
      const auto got = client_.Get(key_ + "/state?seen=" + std::to_string(state_.value("number", 0)));
      if (got && got->status == 200) state_ = nlohmann::json::parse(got->body);
    }
    return true;
  }
  bool wait_until_ready() {
    return wait_for([](const nlohmann::json& state) { return state.contains("face") && !state.at("busy"); });
  }
  const nlohmann::json& state() const { return state_; }

 private:
  int port_;
  httplib::Client client_;
  std::string key_, answer_;
  nlohmann::json state_ = nlohmann::json::object();
};

}  // namespace phantom::workspace_survey
