#include "common/web/request_gate.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>

namespace phantom::web {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

/// A client that sends what it is told.
class RawClient {
 public:
  RawClient(int port, const char* from = "127.0.0.1") : descriptor_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in local{}, remote{};
    local.sin_family = remote.sin_family = AF_INET;
    inet_pton(AF_INET, from, &local.sin_addr);
    inet_pton(AF_INET, "127.0.0.1", &remote.sin_addr);
    remote.sin_port = htons(static_cast<std::uint16_t>(port));
    EXPECT_EQ(::bind(descriptor_, reinterpret_cast<sockaddr*>(&local), sizeof local), 0);
    EXPECT_EQ(connect(descriptor_, reinterpret_cast<sockaddr*>(&remote), sizeof remote), 0);
    const timeval patience{20, 0};
    setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~RawClient() { close(descriptor_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  bool put(const std::string& text) {
    return send(descriptor_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  /// All that comes until the server closes.
  std::string rest() {
    std::string got;
    char octets[4096];
    for (ssize_t size = 0; (size = recv(descriptor_, octets, sizeof octets, 0)) > 0;)
      got.append(octets, static_cast<std::size_t>(size));
    return got;
  }

 private:
  int descriptor_;
};

const std::string kHead = " HTTP/1.1\r\nHost: localhost\r\n";

class Gate : public ::testing::Test {
 protected:
  void serve(const GateLimits& limits) {
    gate_ = std::make_unique<RequestGate>("page", limits,
                                          [](const RequestFrame& frame) { return frame.path == "/urgent"; });
    gate_->server().Get("/quick", [](const httplib::Request&, httplib::Response& response) {
      response.set_content("quick", "text/plain");
    });
    gate_->server().Get("/urgent", [](const httplib::Request&, httplib::Response& response) {
      response.set_content("urgent", "text/plain");
    });
    gate_->server().Get("/slow", [this](const httplib::Request&, httplib::Response& response) {
      std::unique_lock lock(mutex_);
      ++held_;
      changed_.notify_all();
      changed_.wait(lock, [this] { return released_; });
      response.set_content("slow", "text/plain");
    });
    gate_->server().Post("/echo", [](const httplib::Request& request, httplib::Response& response) {
      response.set_content(request.body, "text/plain");
    });
    gate_->bind("127.0.0.1", 0, "page.port");
    gate_->start();
  }
  void TearDown() override { release(); }
  void release() {
    const std::lock_guard lock(mutex_);
    released_ = true;
    changed_.notify_all();
  }
  void wait_until_held(int requests) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, 20s, [&] { return held_ >= requests; }));
  }
  std::string get(const std::string& path, const char* from = "127.0.0.1") {
    RawClient client(gate_->port(), from);
    client.put("GET " + path + kHead + "\r\n");
    return client.rest();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  int held_ = 0;
  bool released_ = false;
  std::unique_ptr<RequestGate> gate_;
};

TEST_F(Gate, ARequestThatComesInPiecesIsAnswered) {
  serve({});
  RawClient client(gate_->port());
  for (const char c : "POST /echo" + kHead + "Content-Length: 3\r\n\r\nabc") client.put(std::string(1, c));
  EXPECT_THAT(client.rest(), HasSubstr("\r\n\r\nabc"));
  EXPECT_THAT(get("/quick"), HasSubstr("200"));
  EXPECT_THAT(get("/nowhere"), HasSubstr("404"));
}

TEST_F(Gate, WhatFollowsTheRequestIsNoRequest) {
  serve({});
  RawClient client(gate_->port());
  client.put("GET /nowhere" + kHead + "\r\nGET /quick" + kHead + "\r\n");
  EXPECT_EQ(client.rest().find("quick\r"), std::string::npos);
}

// Tries synthetic_viewer: late
TEST_F(Gate, ARequestThatDoesNotComeInTimeIsEnded) {
  GateLimits limits;
  limits.request_time = 300ms;
  serve(limits);
  RawClient silent(gate_->port()), headless(gate_->port()), bodiless(gate_->port());
  headless.put("GET / HTTP/1.1\r\nHost: local");
  bodiless.put("POST /echo" + kHead + "Content-Length: 3\r\n\r\na");
  for (RawClient* client : {&silent, &headless, &bodiless}) EXPECT_THAT(client->rest(), HasSubstr(" 408 "));
}

// Tries synthetic_viewer: more connections without a request
TEST_F(Gate, TheOldestOfTheAddressWithMostConnectionsGivesWay) {
  GateLimits limits;
  limits.connections = 6;
  limits.connections_per_address = 4;
  limits.request_time = 60s;
  serve(limits);
  RawClient patient(gate_->port(), "127.0.0.2");
  std::vector<std::unique_ptr<RawClient>> many;
  for (int i = 0; i < 5; ++i) many.push_back(std::make_unique<RawClient>(gate_->port(), "127.0.0.3"));
  EXPECT_THAT(many[0]->rest(), HasSubstr(" 503 ")) << "its address may have four";
  RawClient third(gate_->port(), "127.0.0.4"), fourth(gate_->port(), "127.0.0.5");
  EXPECT_THAT(many[1]->rest(), HasSubstr(" 503 ")) << "all may have six";
  for (RawClient* client : {&patient, &third, &fourth, many[2].get(), many[4].get()}) {
    client->put("GET /quick" + kHead + "\r\n");
    EXPECT_THAT(client->rest(), HasSubstr("quick"));
  }
}

// Tries synthetic_viewer: more than 64 requests … one address
TEST_F(Gate, AnUrgentRequestIsAnsweredWhileAllWorkersAreOccupied) {
  GateLimits limits;
  limits.workers = 2;
  limits.waiting = 4;
  serve(limits);
  std::vector<std::unique_ptr<RawClient>> slow;
  for (int i = 0; i < 2; ++i) {
    slow.push_back(std::make_unique<RawClient>(gate_->port()));
    slow.back()->put("GET /slow" + kHead + "\r\n");
  }
  wait_until_held(2);
  for (int i = 0; i < 2; ++i) {
    slow.push_back(std::make_unique<RawClient>(gate_->port()));
    slow.back()->put("GET /quick" + kHead + "\r\n");
  }
  EXPECT_THAT(get("/quick"), HasSubstr(" 503 ")) << "two of this address wait already";
  for (int i = 0; i < 2; ++i) {
    slow.push_back(std::make_unique<RawClient>(gate_->port(), "127.0.0.2"));
    slow.back()->put("GET /quick" + kHead + "\r\n");
  }
  RawClient fifth(gate_->port(), "127.0.0.3");
  fifth.put("GET /quick" + kHead + "\r\n");
  EXPECT_THAT(fifth.rest(), HasSubstr(" 503 ")) << "four wait in all";
  EXPECT_EQ(GateLimits().waiting, 64);
  EXPECT_THAT(get("/urgent"), HasSubstr("urgent"));
  release();
  EXPECT_THAT(slow[2]->rest(), HasSubstr("quick"));
}

// Tries synthetic_viewer: a request that is too long; chunked
TEST_F(Gate, EndlessHeadersAndBodiesAreCutOff) {
  serve({});
  const std::string line = "X-" + std::string(1000, 'x') + ": y\r\n";
  RawClient headers(gate_->port()), chunks(gate_->port());
  headers.put("GET / HTTP/1.1\r\n");
  chunks.put("POST /echo" + kHead + "Transfer-Encoding: chunked\r\n\r\n");
  bool cut = false;
  for (int i = 0; i < 100'000 && !cut; ++i) cut = !headers.put(line);
  EXPECT_TRUE(cut);
  cut = false;
  for (int i = 0; i < 100'000 && !cut; ++i) cut = !chunks.put("400\r\n" + std::string(1024, 'x') + "\r\n");
  EXPECT_TRUE(cut);
}

TEST_F(Gate, EndsWhileRequestsWaitAndAreAnswered) {
  GateLimits limits;
  limits.workers = 1;
  serve(limits);
  RawClient silent(gate_->port()), held(gate_->port()), waits(gate_->port());
  held.put("GET /slow" + kHead + "\r\n");
  wait_until_held(1);
  waits.put("GET /quick" + kHead + "\r\n");
  release();
  gate_.reset();
  EXPECT_EQ(silent.rest(), "");
}

}  // namespace
}  // namespace phantom::web
