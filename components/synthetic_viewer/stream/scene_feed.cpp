#include "components/synthetic_viewer/stream/scene_feed.hpp"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/core/errors.hpp"
#include "common/core/thread_config.hpp"
#include "phantom_stream/scene_stream.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr std::size_t kMaxText = 128;                          // octets of a client's message
constexpr std::uint64_t kMaxFrames_s = 30, kMaxHands_s = 150;  // of a client; more of one that leads
constexpr std::size_t kDelivery = 65536;  // octets that are made ready for a client at once
constexpr int kMaxUnsent = 8192;          // that wait in the kernel before more is made ready
constexpr int kSendBuffer = 65536;
constexpr double kMinRate_Hz = 1.0, kMaxRate_Hz = 120.0;  // or 0: no scene
constexpr core::Nanoseconds kStalled_ns = 3 * core::kNsPerSecond, kFarewell_ns = core::kNsPerSecond,
                            kSession_ns = core::kNsPerSecond / 5, kStops_ns = core::kNsPerSecond / 10,
                            kAlive_ns = core::kNsPerSecond / 5, kNumbers_ns = core::kNsPerSecond / 30;
constexpr std::uint16_t kSessionEnded = 4001;

/// Returns the message `alive`.
std::string alive_message(core::Nanoseconds now_ns) {
  std::string bytes;
  scene_stream::Alive{core::seconds(now_ns)}.append_to(bytes);
  return bytes;
}

std::string hand_text(HandWord word) {
  return std::string(R"({"type":"hand","state":")") + name_of(word) + "\"}";
}

}  // namespace

struct SceneFeed::Client {
  Client(Follower&& taken, std::uint64_t its_number, bool may_send_hands, core::Nanoseconds now_ns)
      : follower(std::move(taken)),
        number(its_number),
        socket(kMaxText, may_send_hands),
        drained_ns(now_ns),
        second_ns(now_ns) {
    const int descriptor = follower.channel.descriptor();
    setsockopt(descriptor, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
    const auto patience_ms = static_cast<unsigned>(kStalled_ns / core::kNsPerMillisecond);
    setsockopt(descriptor, IPPROTO_TCP, TCP_USER_TIMEOUT, &patience_ms, sizeof patience_ms);
  }
  /// Returns whether more may be made ready: what was is with the network.
  bool drained() {
    int unsent = 0;
    return socket.output().empty() &&
           (ioctl(follower.channel.descriptor(), SIOCOUTQNSD, &unsent) != 0 || unsent <= kMaxUnsent);
  }

  Follower follower;
  std::uint64_t number;  // among all that ever came, from 1 on
  web::WebSocket socket;
  std::optional<HandWord> told;  // of the hand, last
  bool has_led = false;          // poses may be on their way after it was told that it does not any more
  std::uint64_t seen = 0, numbers_seen = 0;  // of the scene's board, and of the numbers'
  SceneMessageLog::Content poses;            // the last ones sent
  core::Nanoseconds period_ns = 0;           // of poses at least; 0: it does not follow the scene
  core::Nanoseconds poses_due_ns = 0, numbers_due_ns = 0, alive_due_ns = 0;
  core::Nanoseconds drained_ns;  // when all was last with the network
  core::Nanoseconds farewell_ns = 0, session_due_ns = 0;
  core::Nanoseconds second_ns;  // begin of the second in which frames are counted
  std::uint64_t frames_before = 0;
  bool lost = false;  // the connection has ended
};

SceneFeed::SceneFeed(const SceneConfig& config, double rate_Hz, std::string cell, Inbox& inbox,
                     PageContent& page, HeadsetHand* hand)
    : rate_Hz_(rate_Hz),
      inbox_(inbox),
      page_(page),
      hand_(hand),
      encoder_(config, rate_Hz, std::move(cell)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      progress_("scene", 1.0 / rate_Hz, kHangsAfter_s) {
  if (wake_ < 0) throw core::MissingError("the scene cannot be served: no file descriptor is free");
}

SceneFeed::~SceneFeed() {
  end();
  close(wake_);
}

void SceneFeed::start() {
  thread_ = std::thread([this] { run(); });
}

void SceneFeed::take(Follower follower) {
  const std::lock_guard lock(mutex_);
  if (ended_) return;
  coming_.push_back(std::move(follower));
  eventfd_write(wake_, 1);
}

void SceneFeed::end() {
  ending_ = true;
  eventfd_write(wake_, 1);
  if (thread_.joinable()) thread_.join();
  const std::lock_guard lock(mutex_);
  ended_ = true;
  coming_.clear();
}

void SceneFeed::run() {
  core::apply_thread_config(core::ThreadRole::kScene);
  progress_.begin();
  const core::Nanoseconds period_ns = core::from_seconds(1.0 / rate_Hz_);
  core::Nanoseconds due_ns = core::monotonic_ns();
  std::vector<pollfd> watched;
  while (!ending_) {
    watched.assign({{wake_, POLLIN, 0}});
    for (Client& client : clients_) {
      const auto events = static_cast<short>(POLLIN | (client.socket.output().empty() ? 0 : POLLOUT));
      watched.push_back({client.follower.channel.descriptor(), events, 0});
    }
    // In nanoseconds: a rounded wait would make the rate uneven.
    const core::Nanoseconds left_ns = std::max<core::Nanoseconds>(0, due_ns - core::monotonic_ns());
    const timespec wait{left_ns / core::kNsPerSecond, left_ns % core::kNsPerSecond};
    if (clients_.empty()) progress_.rest();
    ppoll(watched.data(), watched.size(), clients_.empty() ? nullptr : &wait, nullptr);
    progress_.tick();
    const core::Nanoseconds now_ns = core::monotonic_ns();
    auto state = watched.begin() + 1;
    for (Client& client : clients_) {
      if ((state->revents & ~POLLOUT) != 0) read(client, now_ns);
      if (state->revents != 0 && flush(client, now_ns)) deliver(client, now_ns);
      ++state;
    }
    adopt();
    if (!clients_.empty() && now_ns >= due_ns) {
      compose(now_ns);
      for (Client& client : clients_) deliver(client, now_ns);
      const core::Nanoseconds turn_ns = composed_ ? period_ns : std::max(period_ns, kNumbers_ns);
      due_ns = std::max(due_ns + turn_ns, now_ns + turn_ns / 2);
    }
    for (Client& client : clients_) send_hand(client);
    std::erase_if(clients_, [&](Client& client) { return !keeps(client, now_ns); });
  }
  for (Client& client : clients_) {
    if (hand_ != nullptr) hand_->leave(client.number);
    client.socket.close(web::WebSocket::kGoingAway, "the viewer ends");
    flush(client, core::monotonic_ns());
    client.follower.channel.end_writing();
  }
  for (Client& client : clients_) leave(client);
  clients_.clear();
  progress_.end();
}

void SceneFeed::adopt() {
  eventfd_t woken = 0;
  eventfd_read(wake_, &woken);
  std::vector<Follower> coming;
  {
    const std::lock_guard lock(mutex_);
    coming.swap(coming_);
  }
  if (clients_.empty()) {  // what is known is old
    numbers_ = {};
    numbers_seen_ = 0;
  }
  for (Follower& follower : coming) {
    clients_.emplace_back(std::move(follower), ++clients_so_far_, hand_ != nullptr, core::monotonic_ns());
    page_.state.followers += 1;
  }
}

void SceneFeed::leave(Client& client) {
  let_follow_scene(client, 0);
  page_.state.followers -= 1;
}

void SceneFeed::let_follow_scene(Client& client, core::Nanoseconds period_ns) {
  page_.scene.followers += (period_ns != 0 ? 1 : 0) - (client.period_ns != 0 ? 1 : 0);
  if (period_ns == 0) client.seen = 0;
  if (period_ns == 0) client.poses.reset();
  client.period_ns = period_ns;
}

void SceneFeed::compose(core::Nanoseconds now_ns) {
  if (const auto state = page_.state.next(numbers_seen_, std::chrono::milliseconds(0))) numbers_.put(*state);
  std::uint64_t told_to_all = std::numeric_limits<std::uint64_t>::max();
  for (const Client& client : clients_) told_to_all = std::min(told_to_all, client.numbers_seen);
  numbers_.forget(told_to_all);
  composed_ = std::ranges::any_of(clients_, [](const Client& client) { return client.period_ns != 0; });
  if (!composed_) return;
  if (auto base = page_.scene.next(base_seen_, std::chrono::milliseconds(0))) encoder_.take(std::move(base));
  inbox_.arm.read<Inbox::kScene>(live_.arm);
  inbox_.percept.read<Inbox::kScene>(live_.percept);
  inbox_.master.read<Inbox::kScene>(live_.master);
  inbox_.gripper.read<Inbox::kScene>(live_.gripper);
  for (std::size_t i = 0; i < live_.others.size(); ++i) inbox_.others[i].read<Inbox::kScene>(live_.others[i]);
  if (now_ns >= stops_due_ns_) {
    live_.stops = inbox_.stops.at(now_ns);
    stops_due_ns_ = now_ns + kStops_ns;
  }
  encoder_.compose(live_, now_ns);
  std::uint64_t seen_by_all = encoder_.board().newest();
  for (const Client& client : clients_)
    if (client.period_ns != 0) seen_by_all = std::min(seen_by_all, client.seen);
  encoder_.board().forget(seen_by_all);
}

void SceneFeed::deliver(Client& client, core::Nanoseconds now_ns) {
  if (client.lost || client.socket.closing() || !client.drained()) return;
  if (now_ns >= client.numbers_due_ns) {
    if (const std::string numbers = numbers_.since(client.numbers_seen); !numbers.empty()) {
      client.socket.send(false, numbers);
      client.numbers_due_ns = now_ns + kNumbers_ns;
    }
  }
  if (client.period_ns != 0 && composed_) deliver_scene(client, now_ns);
  if (now_ns >= client.alive_due_ns) {
    client.socket.send(true, alive_message(now_ns));
    client.alive_due_ns = now_ns + kAlive_ns;
  }
  flush(client, now_ns);
}

void SceneFeed::deliver_scene(Client& client, core::Nanoseconds now_ns) {
  std::string& output = client.socket.output();
  while (output.size() < kDelivery) {
    const auto next = encoder_.board().next(client.seen);
    if (!next) break;
    client.socket.send(next->binary, next->octets);
    client.socket.output();
  }
  const auto& poses = encoder_.poses();
  if (!poses || poses == client.poses || now_ns < client.poses_due_ns) return;
  client.socket.send(true, poses->octets);
  client.poses = poses;
  // Half a tick earlier than asked, as ticks are not exact.
  client.poses_due_ns = now_ns + client.period_ns - core::from_seconds(0.5 / rate_Hz_);
  client.alive_due_ns = now_ns + kAlive_ns;
}

void SceneFeed::read(Client& client, core::Nanoseconds now_ns) {
  if (now_ns - client.second_ns >= core::kNsPerSecond) {
    client.second_ns = now_ns;
    client.frames_before = client.socket.frames();
  }
  // What it has sent too much of is left with the kernel until its farewell is gone.
  if (client.socket.closing() && !client.socket.output().empty()) return;
  std::array<char, 2048> octets;
  std::size_t got = 0;
  const web::Channel::Step step = client.follower.channel.read(octets.data(), octets.size(), got);
  if (step == web::Channel::Step::kClosed || step == web::Channel::Step::kNoTls) client.lost = true;
  if (step != web::Channel::Step::kDone) return;
  for (const std::string& text : client.socket.receive({octets.data(), got})) obey(client, text);
  for (const std::string& message : client.socket.binaries())
    if (const core::Status taken = hand_->take(client.number, message, now_ns); !taken)
      client.socket.close(web::WebSocket::kNoSense, taken.message());
  const std::uint64_t most = kMaxFrames_s + (client.has_led ? kMaxHands_s : 0);
  if (client.socket.frames() - client.frames_before > most && !client.socket.closing())
    client.socket.close(web::WebSocket::kPolicy, "too many messages");
}

void SceneFeed::obey(Client& client, const std::string& text) {
  using Json = nlohmann::json;
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || json.size() != 1 || !json.begin()->is_number())
    return client.socket.close(web::WebSocket::kNoSense, R"({"rate_Hz": n} or {"echo": n} is expected)");
  const double value = json.begin()->get<double>();
  if (json.contains("echo"))
    return client.socket.send(false, R"({"type":"echo","echo":)" + json["echo"].dump() + "}");
  if (json.contains("hand") && hand_ != nullptr) return ask_for_hand(client, value != 0.0);
  if (!json.contains("rate_Hz") || !(value == 0 || (value >= kMinRate_Hz && value <= kMaxRate_Hz)))
    return client.socket.close(web::WebSocket::kNoSense, "rate_Hz: 0, or 1 to 120; echo: any number");
  let_follow_scene(client, value == 0 ? 0 : core::from_seconds(1.0 / value));
}

void SceneFeed::ask_for_hand(Client& client, bool wanted) {
  const bool may = client.follower.may_lead && client.follower.may_lead();
  if (!wanted) hand_->leave(client.number);
  client.has_led = (wanted && may && hand_->claim(client.number, core::monotonic_ns())) || client.has_led;
  client.told = wanted && !may ? std::optional(HandWord::kForbidden) : std::nullopt;
  if (client.told) client.socket.send(false, hand_text(HandWord::kForbidden));
}

// Each is told how it is with the hand as it begins, when that changes, and when it has asked.
void SceneFeed::send_hand(Client& client) {
  if (hand_ == nullptr || client.socket.closing()) return;
  const HandWord word = hand_->word(client.number);
  if (client.told == word || (client.told == HandWord::kForbidden && word == HandWord::kFree)) return;
  client.told = word;
  client.socket.send(false, hand_text(word));
}

bool SceneFeed::flush(Client& client, core::Nanoseconds now_ns) {
  std::string& output = client.socket.output();
  std::size_t done = 0;
  while (!client.lost && done < output.size()) {
    std::size_t sent = 0;
    const auto step = client.follower.channel.write(std::string_view(output).substr(done), sent);
    done += sent;
    if (step == web::Channel::Step::kClosed) client.lost = true;
    if (step != web::Channel::Step::kDone) break;
  }
  output.erase(0, done);
  if (client.drained()) client.drained_ns = now_ns;
  return !client.lost;
}

bool SceneFeed::keeps(Client& client, core::Nanoseconds now_ns) {
  if (client.drained()) client.drained_ns = now_ns;
  if (now_ns >= client.session_due_ns && !client.socket.closing()) {
    client.session_due_ns = now_ns + kSession_ns;
    if (hand_ != nullptr && hand_->is_of(client.number) && !client.follower.may_lead())
      hand_->leave(client.number);
    if (!client.follower.lasts()) {
      client.socket.close(kSessionEnded, "the session has ended");
      flush(client, now_ns);
    }
  }
  if (client.socket.closing() && client.farewell_ns == 0) client.farewell_ns = now_ns;
  const bool said = client.socket.closed() && client.socket.output().empty();
  const bool waited = client.farewell_ns != 0 && now_ns - client.farewell_ns > kFarewell_ns;
  const bool stalled = now_ns - client.drained_ns > kStalled_ns;
  if (!client.lost && !said && !waited && !stalled) return true;
  if (hand_ != nullptr) hand_->leave(client.number);
  client.follower.channel.end_writing();
  leave(client);
  return false;
}

}  // namespace phantom::synthetic_viewer
