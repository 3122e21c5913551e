#pragma once
// The page's server with what a viewer would give it, and clients.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>
#undef _res  // a macro of resolv.h, which httplib.h includes: a name of Eigen's

#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "components/synthetic_viewer/page/commands.hpp"
#include "components/synthetic_viewer/page/web_server.hpp"

namespace phantom::synthetic_viewer::test {

class Page : public ::testing::Test {
 protected:
  /// `port`: 0: any free one.
  void serve(PageConfig config = {}, int port = 0) {
    config.port = port;
    server_ = std::make_unique<WebServer>(
        config, content_,
        [this](const Command& command) {
          const std::lock_guard lock(mutex_);
          commands_.push_back(command);
          return outcome_;
        },
        [this](const ViewRequest& request) {
          const std::lock_guard lock(mutex_);
          requests_.push_back(request);
          return core::Status::ok();
        },
        [this](const WorkspaceRequest& request) {
          const std::lock_guard lock(mutex_);
          if (const auto* carry = std::get_if<CarryRequest>(&request)) carries_.push_back(*carry);
          if (const auto* correct = std::get_if<CorrectionRequest>(&request))
            corrections_.push_back(*correct);
          return outcome_;
        },
        scene_);
  }
  httplib::Client client() const { return client_of(server_->port()); }
  httplib::Client stream_client() const { return client_of(server_->stream_port()); }
  httplib::Client client_of(int port) const {
    httplib::Client client((trusted_.empty() ? "http" : "https") + ("://127.0.0.1:" + std::to_string(port)));
    if (!trusted_.empty()) client.set_ca_cert_path(trusted_);
    client.set_read_timeout(20);
    return client;
  }
  /// Status and message of a posted command.
  std::pair<int, std::string> post(const std::string& body, const httplib::Headers& headers = {},
                                   const char* type = "application/json",
                                   const char* path = "/command") const {
    const auto result = client().Post(path, headers, body, type);
    if (!result) return {0, httplib::to_string(result.error())};
    return {result->status, nlohmann::json::parse(result->body).at("message").get<std::string>()};
  }
  /// The stream's beginning, until `enough` is satisfied.
  std::string follow(const char* path, const std::function<bool(const std::string&)>& enough) const {
    std::string got;
    stream_client().Get(path, [&](const char* data, std::size_t size) {
      got.append(data, size);
      return !enough(got);
    });
    return got;
  }

  std::string trusted_;  ///< the page's certificate; empty: it speaks HTTP
  PageContent content_;
  std::mutex mutex_;
  std::vector<Command> commands_;
  std::vector<ViewRequest> requests_;
  std::vector<CarryRequest> carries_;
  std::vector<CorrectionRequest> corrections_;
  CommandOutcome outcome_;
  SceneFeed* scene_ = nullptr;
  std::unique_ptr<WebServer> server_;
};

}  // namespace phantom::synthetic_viewer::test
