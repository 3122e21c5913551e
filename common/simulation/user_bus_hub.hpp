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

/// Serves a CAN bus to the processes of one user on this host, for machines whose kernel has no CAN.
/// Arbitration by identifier, bit rate, bus-off and faults are those of BusModel, on the real clock. It runs
/// a thread of its own. Nodes connect by can::open_bus("user:NAME"). The sockets are in the abstract
/// namespace, so no files are left behind.
class UserBusHub {
 public:
  /// Errors: kInvalidArgument; kFailedPrecondition if the name is already served.
  static core::Expected<std::unique_ptr<UserBusHub>> serve(const std::string& address,
                                                           const BusModelOptions& options);
  ~UserBusHub();
  UserBusHub(const UserBusHub&) = delete;
  UserBusHub& operator=(const UserBusHub&) = delete;

  /// Returns the number of connected nodes. This and the following functions may be called from any thread.
  std::size_t node_count() const;
  void set_faults(std::vector<FaultRule> rules);
  /// Puts the controllers of all nodes of process `pid` into bus-off.
  void set_bus_off(int pid);
  /// Unplugs all nodes of process `pid`, or plugs them in.
  void set_plugged(int pid, bool plugged);

 private:
  struct Client {
    int socket = -1;
    int pid = 0;
    BusModel::NodeId node = 0;
    std::uint64_t lost = 0;  // frames lost since the last report to the client
    bool waiting = true;     // packets may wait in its socket
  };
  UserBusHub(int listener, int waker, const BusModelOptions& options);
  void run();
  void accept_clients();
  bool read_client(Client& client);
  void deliver(BusModel::NodeId to, const can::Received& received);
  void wake() const noexcept;

  int listener_, waker_;
  mutable std::mutex mutex_;  // guards the members below
  BusModel model_;
  std::vector<Client> clients_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace phantom::simulation
