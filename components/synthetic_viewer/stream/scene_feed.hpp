#pragma once

#include <atomic>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/core/progress.hpp"
#include "common/web/channel.hpp"
#include "common/web/web_socket.hpp"
#include "components/synthetic_viewer/state/inbox.hpp"
#include "components/synthetic_viewer/stream/headset_hand.hpp"
#include "components/synthetic_viewer/stream/page_content.hpp"
#include "components/synthetic_viewer/stream/scene_encoder.hpp"
#include "components/synthetic_viewer/stream/state_delta.hpp"

namespace phantom::synthetic_viewer {

/// Serves the scene stream (README.md): one thread sends the page's numbers and alerts to all followers, and
/// to those who ask for it what browsers draw by themselves, which it composes from the newest samples and
/// from what the drawing thread knows, and encodes once. It waits for none of them: who reads slowly skips,
/// who reads nothing for 3 s is cut off. While nobody follows it does nothing.
class SceneFeed {
 public:
  /// A follower's connection after the handshake.
  struct Follower {
    web::Channel channel;
    std::function<bool()> lasts;        ///< whether its session goes on
    std::shared_ptr<const void> place;  ///< is given back when the follower has gone
    std::function<bool()> may_lead;     ///< whether its session may lead the arm; empty: no
  };

  /// `cell`: its name. `hand`: by which a follower's controller leads the arm; null: none does. All others
  /// must outlive the feed.
  SceneFeed(const SceneConfig& config, double rate_Hz, std::string cell, Inbox& inbox, PageContent& page,
            HeadsetHand* hand = nullptr);
  /// Ends the thread and all connections.
  ~SceneFeed();
  SceneFeed(const SceneFeed&) = delete;
  SceneFeed& operator=(const SceneFeed&) = delete;

  void start();
  /// Takes a follower. Any thread; it does not wait. One that comes after end() is closed.
  void take(Follower follower);
  /// Says farewell to all followers and ends the thread. None of their functions is called afterwards.
  void end();
  /// Returns the progress of the thread. Any thread.
  core::LoopStatistics progress() const { return progress_.statistics(); }

 private:
  struct Client;
  void run();
  void adopt();
  void compose(core::Nanoseconds now_ns);
  void deliver(Client& client, core::Nanoseconds now_ns);
  void deliver_scene(Client& client, core::Nanoseconds now_ns);
  void read(Client& client, core::Nanoseconds now_ns);
  void obey(Client& client, const std::string& text);
  /// Lets a client have the scene at most every `period_ns`; 0: not.
  void let_follow_scene(Client& client, core::Nanoseconds period_ns);
  void leave(Client& client);
  void ask_for_hand(Client& client, bool wanted);
  void send_hand(Client& client);
  /// Returns whether the client is still there.
  bool flush(Client& client, core::Nanoseconds now_ns);
  bool keeps(Client& client, core::Nanoseconds now_ns);

  static constexpr double kHangsAfter_s = 3.0;

  const double rate_Hz_;  ///< of poses, at most
  Inbox& inbox_;
  PageContent& page_;
  HeadsetHand* const hand_;
  std::uint64_t clients_so_far_ = 0;
  SceneEncoder encoder_;
  StateDelta numbers_;
  std::uint64_t numbers_seen_ = 0;  // of page_.state
  LiveSamples live_;
  std::uint64_t base_seen_ = 0;
  core::Nanoseconds stops_due_ns_ = 0;
  bool composed_ = false;      // the scene, at the last turn: what the encoder has is new
  std::list<Client> clients_;  // used by the thread only
  std::mutex mutex_;
  std::vector<Follower> coming_;  // guarded by mutex_
  bool ended_ = false;            // guarded by mutex_
  std::atomic<bool> ending_{false};
  int wake_ = -1;
  core::Progress progress_;
  std::thread thread_;
};

}  // namespace phantom::synthetic_viewer
