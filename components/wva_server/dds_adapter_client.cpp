#include "components/wva_server/dds_adapter_client.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/living.hpp"

namespace phantom::wva_server {

std::optional<Listing> list_objects(const core::NetworkOptions& network, double timeout_s) {
  std::mutex mutex;
  std::condition_variable changed;
  Listing listing;
  std::map<std::uint16_t, messages::WorkspaceObject> objects;
  double served_version = 0.0, served_objects = -1.0,
         served_live = 0.0;  // from wva_server's component_status
  const auto under_lock = [&](auto take) {
    return [&, take](const auto& message, const dds::SampleInfo&) {
      const auto sample = messages::from_idl(message);
      if (!sample) return;
      {
        const std::lock_guard lock(mutex);
        take(*sample);
      }
      changed.notify_one();
    };
  };
  dds::Participant participant("wva_server_command", network);
  const dds::Reader<msg::WorkspaceVersion> versions(
      participant, dds::kWorkspaceVersion, under_lock([&](const messages::WorkspaceVersion& version) {
        listing.cell = version.cell;
        listing.version = version.description.version;
        listing.bricks = version.description.brick_count;
        listing.carried = version.carried;
      }));
  const dds::Reader<msg::WorkspaceObject> objects_reader(
      participant, dds::kWorkspaceObject, under_lock([&](const messages::WorkspaceObject& object) {
        objects.erase(object.id);
        if (!object.removed()) objects[object.id] = object;
      }));
  const dds::Reader<msg::ComponentStatus> statuses(participant, dds::kComponentStatus,
                                                   under_lock([&](const messages::ComponentStatus& status) {
                                                     if (status.component != "wva_server") return;
                                                     for (const core::HealthFigure& figure : status.figures) {
                                                       if (figure.name == "version")
                                                         served_version = figure.value;
                                                       if (figure.name == "objects")
                                                         served_objects = figure.value;
                                                       if (figure.name == "live_objects")
                                                         served_live = figure.value;
                                                     }
                                                   }));
  // Cameras change versions and their things again and again: what is served may be newer than what was told.
  const auto of_model = [&] {
    return std::ranges::count_if(objects, [](const auto& entry) { return !messages::is_live(entry.first); });
  };
  std::unique_lock lock(mutex);
  const bool whole = changed.wait_for(lock, std::chrono::duration<double>(timeout_s), [&] {
    return listing.version != 0 && served_version != 0.0 &&
           served_version <= static_cast<double>(listing.version) &&
           served_objects == static_cast<double>(of_model());
  });
  if (!whole) return std::nullopt;
  // Things that cameras see come and go: a listing is not refused for one that has just gone.
  changed.wait_for(lock, std::chrono::seconds(2), [&] {
    return served_live <= static_cast<double>(objects.size()) - static_cast<double>(of_model());
  });
  for (const auto& [id, object] : objects) listing.objects.push_back(object);
  return listing;
}

}  // namespace phantom::wva_server
