#include "components/wva_server/dds_adapter_client.hpp"

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>

#include "common/dds/endpoint.hpp"
#include "common/dds/requester.hpp"
#include "components/wva_server/dds_adapter_convert.hpp"

namespace phantom::wva_server {

struct CommandClient::Impl {
  explicit Impl(const core::NetworkOptions& network) : participant("wva_server_command", network) {}

  dds::Participant participant;
  dds::Requester<msg::WorkspaceCommand, msg::WorkspaceReply> requester{participant, dds::kWorkspaceCommand,
                                                                       dds::kWorkspaceReply};
};

CommandClient::CommandClient(const core::NetworkOptions& network) : impl_(std::make_unique<Impl>(network)) {}
CommandClient::~CommandClient() = default;

std::optional<Reply> CommandClient::ask(const CellCommand& command, double timeout_s,
                                        const std::function<void(const Reply&)>& on_accepted) {
  std::optional<Reply> last;
  impl_->requester.ask(to_message(command, dds::requester_name("wva_server command")), timeout_s,
                       [&](const msg::WorkspaceReply& reply) {
                         const Reply heard = to_reply(reply);
                         if (heard.outcome != Outcome::kAccepted) {
                           last = heard;
                           return true;
                         }
                         on_accepted(heard);
                         return false;
                       });
  return last;
}

std::optional<Listing> CommandClient::list(double timeout_s) {
  std::mutex mutex;
  std::condition_variable changed;
  Listing listing;
  std::map<std::uint16_t, messages::WorkspaceObject> objects;
  double served_version = 0.0, served_objects = -1.0;  // from wva_server's component_status
  const auto under_lock = [&](auto take) {
    return [&, take](const auto& sample, const dds::SampleInfo&) {
      {
        const std::lock_guard lock(mutex);
        take(sample);
      }
      changed.notify_one();
    };
  };
  dds::Reader<msg::WorkspaceVersion> versions(impl_->participant, dds::kWorkspaceVersion,
                                              under_lock([&](const msg::WorkspaceVersion& version) {
                                                listing.cell = version.cell().c_str();
                                                listing.version = version.version();
                                                listing.bricks = version.brick_count();
                                              }));
  dds::Reader<msg::WorkspaceObject> objects_reader(impl_->participant, dds::kWorkspaceObject,
                                                   under_lock([&](const msg::WorkspaceObject& object) {
                                                     const auto told = messages::from_idl(object);
                                                     if (!told) return;
                                                     objects.erase(told->id);
                                                     if (!told->removed()) objects[told->id] = *told;
                                                   }));
  dds::Reader<msg::ComponentStatus> statuses(impl_->participant, dds::kComponentStatus,
                                             under_lock([&](const msg::ComponentStatus& status) {
                                               if (status.component_name() != "wva_server") return;
                                               for (const msg::Figure& figure : status.figures()) {
                                                 if (figure.name() == "version")
                                                   served_version = figure.value();
                                                 if (figure.name() == "objects")
                                                   served_objects = figure.value();
                                               }
                                             }));
  std::unique_lock lock(mutex);
  const bool whole = changed.wait_for(lock, std::chrono::duration<double>(timeout_s), [&] {
    return listing.version != 0 && served_version == static_cast<double>(listing.version) &&
           served_objects == static_cast<double>(objects.size());
  });
  if (!whole) return std::nullopt;
  for (auto& [id, object] : objects) listing.objects.push_back(object);
  return listing;
}

}  // namespace phantom::wva_server
