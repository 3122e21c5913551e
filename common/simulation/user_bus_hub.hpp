#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/core/status.hpp"
#include "common/simulation/bus_model.hpp"

namespace phantom::simulation {

/// Serves a CAN bus to the processes of one user on this host, for machines whose kernel has none:
/// arbitration by identifier, pacing by a bit rate, bus-off and faults as BusModel has them, on the real
/// clock. A thread of its own; nodes come by can::open_bus("user:NAME") (sockets of the abstract namespace:
/// nothing is left behind).
class UserBusHub {
 public:
  /// Errors: kInvalidArgument; kFailedPrecondition if the name is already served.
  static core::Expected<std::unique_ptr<UserBusHub>> serve(const std::string& address,
                                                           const BusModelOptions& options);
  ~UserBusHub();
  UserBusHub(const UserBusHub&) = delete;
  UserBusHub& operator=(const UserBusHub&) = delete;

  /// Nodes that are connected now. These and the following may be called from any thread.
  std::size_t node_count() const;
  void set_faults(std::vector<FaultRule> rules);
  /// Sends the controllers of all nodes of process `pid` to bus-off.
  void set_bus_off(int pid);
  /// Unplugs (or plugs in) all nodes of process `pid`.
  void set_plugged(int pid, bool plugged);

 private:
  struct Client {
    int socket = -1;
    int pid = 0;
    BusModel::NodeId node = 0;
    std::uint64_t lost = 0;  // since it was last told
  };
  UserBusHub(int listener, int waker, const BusModelOptions& options);
  void run();
  void accept_clients();
  bool read_client(Client& client);
  void deliver(BusModel::NodeId to, const can::Received& received);
  void wake() const noexcept;

  int listener_, waker_;
  mutable std::mutex mutex_;  // guards what follows
  BusModel model_;
  std::vector<Client> clients_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace phantom::simulation
