// A cable between two interfaces that can be bad: it loses, delays, jitters and repeats frames, is cut and
// healed. It does what `tc netem` does, on every Linux: many kernels (also in containers and small virtual
// machines) come without netem.
//
// cable INTERFACE_A INTERFACE_B; then a line on standard input for each change:
//   set LOSS DELAY_MS JITTER_MS [REPEATED]   share of frames lost, 0…1; each way; evenly spread around the
//   delay, never overtaking; share of frames that come a second time, each after a delay of its own
//   cut | cut a | cut b | heal      both ways, or only what comes from INTERFACE_A or from INTERFACE_B
//   fragments lost | passed         fragments of IP packets, as by many firewalls and tunnels
// After each line it says "ok" and how many frames it carried and lost so far. It ends with its standard
// input.
#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <netinet/ip.h>
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <iostream>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

[[noreturn]] void fail(const std::string& what) {
  std::perror(("cable: " + what).c_str());
  std::exit(3);
}

// All frames of an interface, whole: also what its offloads leave undone (checksums), which travels in a
// header.
int open_end(const char* name) {
  const int end = socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK, htons(ETH_P_ALL));
  if (end < 0) fail("a packet socket needs the rights of root");
  const int on = 1, room = 32 << 20;
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_ALL);
  address.sll_ifindex = static_cast<int>(if_nametoindex(name));
  if (address.sll_ifindex == 0) fail(name);
  if (setsockopt(end, SOL_PACKET, PACKET_VNET_HDR, &on, sizeof on) != 0) fail("PACKET_VNET_HDR");
  if (setsockopt(end, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof on) != 0)
    fail("PACKET_IGNORE_OUTGOING");
  setsockopt(end, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room);
  setsockopt(end, SOL_SOCKET, SO_SNDBUFFORCE, &room, sizeof room);
  if (bind(end, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) fail(name);
  return end;
}

struct Quality {
  double loss = 0.0, delay_ms = 0.0, jitter_ms = 0.0, repeated = 0.0;
  bool cut_a = false, cut_b = false;  // what comes from there is lost
  bool fragments_lost = false;
};

// Whether a frame, behind its virtio_net_hdr, holds a part of an IPv4 packet.
bool is_fragment(const std::vector<char>& frame, ssize_t size) {
  constexpr std::size_t kHeader = 10;  // virtio_net_hdr
  ether_header link{};
  iphdr packet{};
  if (static_cast<std::size_t>(size) < kHeader + sizeof link + sizeof packet) return false;
  std::memcpy(&link, frame.data() + kHeader, sizeof link);
  std::memcpy(&packet, frame.data() + kHeader + sizeof link, sizeof packet);
  return link.ether_type == htons(ETHERTYPE_IP) && (packet.frag_off & htons(IP_MF | IP_OFFMASK)) != 0;
}

struct Frame {
  Clock::time_point due;
  std::vector<char> bytes;
};

class Way {
 public:
  Way(int from, int to) : from_(from), to_(to), buffer_(1 << 17) {}

  void take_in(const Quality& quality, bool cut, std::mt19937& random) {
    for (;;) {
      const ssize_t size = recv(from_, buffer_.data(), buffer_.size(), 0);
      if (size <= 0) return;
      std::uniform_real_distribution<double> share(0.0, 1.0);
      const bool fragment = quality.fragments_lost && is_fragment(buffer_, size);
      if (cut || fragment || share(random) < quality.loss) {
        ++lost;
        continue;
      }
      const int times = share(random) < quality.repeated ? 2 : 1;
      for (int i = 0; i < times; ++i) put({buffer_.begin(), buffer_.begin() + size}, quality, share(random));
    }
  }
  void pass_on() {
    for (const auto now = Clock::now(); !frames_.empty() && frames_.front().due <= now; frames_.pop_front()) {
      const auto& bytes = frames_.front().bytes;
      if (send(to_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size())) {
        ++carried;
      } else {
        ++lost;
      }
    }
  }
  void forget() {
    lost += frames_.size();
    frames_.clear();
  }
  Clock::time_point next(Clock::time_point otherwise) const {
    return frames_.empty() ? otherwise : frames_.front().due;
  }

  std::uint64_t carried = 0, lost = 0;

 private:
  // `where`: in the spread of the jitter, 0…1.
  void put(std::vector<char> frame, const Quality& quality, double where) {
    const double delay_ms = std::max(0.0, quality.delay_ms + (2.0 * where - 1.0) * quality.jitter_ms);
    const auto due = Clock::now() + std::chrono::microseconds(static_cast<std::int64_t>(delay_ms * 1000.0));
    latest_ = std::max(latest_, due);
    frames_.push_back({latest_, std::move(frame)});
  }

  int from_, to_;
  std::vector<char> buffer_;
  std::deque<Frame> frames_;
  Clock::time_point latest_{};
};

bool obey(const std::string& line, Quality& quality) {
  std::istringstream words(line);
  std::string word;
  words >> word;
  if (word == "cut" || word == "heal") {
    std::string from;
    words >> from;
    quality.cut_a = word == "cut" && from != "b";
    quality.cut_b = word == "cut" && from != "a";
    return from.empty() || (word == "cut" && (from == "a" || from == "b"));
  }
  if (word == "fragments") {
    std::string what;
    words >> what;
    quality.fragments_lost = what == "lost";
    return what == "lost" || what == "passed";
  }
  Quality requested = quality;
  if (word != "set" || !(words >> requested.loss >> requested.delay_ms >> requested.jitter_ms)) return false;
  if (!(words >> requested.repeated)) requested.repeated = 0.0;
  quality = requested;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: cable INTERFACE_A INTERFACE_B\n";
    return 2;
  }
  // A cable waits for nobody: the hosts at its ends, whose loops have real-time priority, share this machine.
  sched_param priority{};
  priority.sched_priority = 50;
  sched_setscheduler(0, SCHED_FIFO, &priority);
  const int a = open_end(argv[1]), b = open_end(argv[2]);
  Way there(a, b), back(b, a);
  Quality quality;
  std::mt19937 random(42);
  std::string typed;
  std::cout << "ok\n" << std::flush;
  for (;;) {
    const auto now = Clock::now();
    const auto wake =
        std::min(there.next(now + std::chrono::seconds(1)), back.next(now + std::chrono::seconds(1)));
    const auto left = std::max(Clock::duration::zero(), wake - now);
    const timespec wait{std::chrono::duration_cast<std::chrono::seconds>(left).count(),
                        std::chrono::duration_cast<std::chrono::nanoseconds>(left).count() % 1'000'000'000};
    pollfd ends[] = {{a, POLLIN, 0}, {b, POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}};
    ppoll(ends, 3, &wait, nullptr);
    // On a long cable nobody sees this; frames come in bursts, and each waking costs as much as a frame.
    if (quality.delay_ms >= 1.0) std::this_thread::sleep_for(std::chrono::microseconds(250));
    there.take_in(quality, quality.cut_a, random);
    back.take_in(quality, quality.cut_b, random);
    there.pass_on();
    back.pass_on();
    if (ends[2].revents == 0) continue;
    char text[256];
    const ssize_t size = read(STDIN_FILENO, text, sizeof text);
    if (size <= 0) return 0;
    typed.append(text, static_cast<std::size_t>(size));
    for (auto end = typed.find('\n'); end != std::string::npos; end = typed.find('\n')) {
      const bool known = obey(typed.substr(0, end), quality);
      typed.erase(0, end + 1);
      if (quality.cut_a) there.forget();
      if (quality.cut_b) back.forget();
      std::cout << (known ? "ok" : "unknown") << ' ' << there.carried + back.carried << ' '
                << there.lost + back.lost << '\n'
                << std::flush;
    }
  }
}
