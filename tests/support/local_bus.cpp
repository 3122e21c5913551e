#include "tests/support/local_bus.hpp"

#include <algorithm>

namespace phantom::simulation {

class LocalBus::Node final : public can::CanBus {
 public:
  static constexpr std::size_t kReceiveFrames = 4096;

  Node(LocalBus& bus, std::string name) : bus_(bus), id_(bus.model_.attach()), name_(std::move(name)) {
    ring_.resize(kReceiveFrames);
  }
  ~Node() override {
    bus_.model_.detach(id_);
    bus_.nodes_[id_] = nullptr;
  }

  can::SendResult send(const can::CanFrame& frame) noexcept override {
    if (!is_valid(frame)) return can::SendResult::kInvalid;
    if (state_ != can::BusState::kBusOff && bus_.model_.submit(id_, frame, bus_.now_ns_)) {
      ++counters_.sent;
      return can::SendResult::kSent;
    }
    ++counters_.refused;
    return state_ == can::BusState::kBusOff ? can::SendResult::kBusOff : can::SendResult::kQueueFull;
  }

  bool receive(can::Received& received) noexcept override {
    if (overflow_to_report_) {
      overflow_to_report_ = false;
      ++counters_.errors;
      received = {.frame = {}, .errors = can::kErrorOverflow, .state = state_, .time_ns = bus_.now_ns_};
      return true;
    }
    while (count_ > 0) {
      received = ring_[first_];
      first_ = (first_ + 1) % kReceiveFrames;
      --count_;
      if (received.is_frame() && everything_ == false && !passes(filters_, received.frame)) continue;
      state_ = received.is_frame() ? state_ : received.state;
      received.state = state_;
      ++(received.is_frame() ? counters_.received : counters_.errors);
      if (received.errors & can::kErrorBusOff) ++counters_.bus_offs;
      return true;
    }
    return false;
  }

  bool wait(core::Nanoseconds) noexcept override { return count_ > 0 || overflow_to_report_; }

  core::Status set_filters(std::span<const can::CanFilter> filters) override {
    filters_.assign(filters.begin(), filters.end());
    everything_ = false;
    return core::Status::ok();
  }

  core::Status restart() override {
    bus_.model_.restart(id_, bus_.now_ns_);
    return core::Status::ok();
  }

  can::BusState state() const noexcept override { return state_; }
  const can::BusCounters& counters() const noexcept override { return counters_; }
  const std::string& address() const noexcept override { return name_; }

  void deliver(const can::Received& received) noexcept {
    if (count_ == kReceiveFrames) {
      ++counters_.lost;
      overflow_to_report_ = true;
      return;
    }
    ring_[(first_ + count_++) % kReceiveFrames] = received;
  }
  BusModel::NodeId id() const noexcept { return id_; }

 private:
  LocalBus& bus_;
  BusModel::NodeId id_;
  std::string name_;
  std::vector<can::Received> ring_;
  std::size_t first_ = 0, count_ = 0;
  std::vector<can::CanFilter> filters_;
  bool everything_ = true, overflow_to_report_ = false;
  can::BusState state_ = can::BusState::kActive;
  can::BusCounters counters_;
};

LocalBus::LocalBus(const BusModelOptions& options) : model_(options) {}
LocalBus::~LocalBus() = default;

std::unique_ptr<can::CanBus> LocalBus::connect(const std::string& name) {
  auto node = std::make_unique<Node>(*this, name);
  nodes_.resize(std::max(nodes_.size(), node->id() + 1));
  nodes_[node->id()] = node.get();
  return node;
}

void LocalBus::advance_to(core::Nanoseconds now_ns) {
  now_ns_ = std::max(now_ns_, now_ns);
  model_.advance(now_ns_, [this](BusModel::NodeId to, const can::Received& r) { nodes_[to]->deliver(r); });
}

void LocalBus::set_bus_off(const can::CanBus& node) {
  model_.set_bus_off(static_cast<const Node&>(node).id(), now_ns_);
}

void LocalBus::set_plugged(const can::CanBus& node, bool plugged) {
  model_.set_plugged(static_cast<const Node&>(node).id(), plugged);
}

}  // namespace phantom::simulation
