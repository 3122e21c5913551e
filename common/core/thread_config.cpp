#include "common/core/thread_config.hpp"

#include <pthread.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <thread>

namespace phantom::core {
namespace {

using enum ThreadRole;
constexpr int kOrdinary = ThreadConfig::kOrdinary;

// A thread that waits for fewer things has a higher priority. A thread that publishes for the servo comes
// before the receivers, so that a burst of samples does not delay our own states. So does who reads an
// enabling switch. Simulated drives and their bus replace hardware that would run in parallel. Sensing
// computes longest and comes after the receivers, so that it never delays the link. The main thread of a
// process in the haptic path sometimes publishes, holding locks of Fast DDS that the publisher needs too: it
// must not be kept from running meanwhile.
constexpr ThreadConfig kScheme[] = {
    {kServo, "servo", 0, "master_io, slave_io", "control, every period", "its clock alone"},
    {kBareLoop, "bare_loop", 0, "master_io, slave_io", "nothing, every period: what the host can do at best",
     "its clock alone"},
    {kPublisher, "publisher", 2, "master_io, slave_io", "publishes what the servo leaves",
     "the servo's tick; locks of Fast DDS and a socket's buffer"},
    {kSwitch, "switch", 2, "master_io, slave_io", "reads the input device of an enabling switch",
     "the device"},
    {kCanBus, "can_bus", 2, "simulated_drive", "serves a CAN bus in user space", "its nodes' sockets"},
    {kDrives, "", 2, "simulated_drive", "the main thread: the drives' motion and answers", "its bus"},
    {kReceiver, "receiver", 4, "all; FIFO in master_io, slave_io, phantom_sensing",
     "takes samples from the network and calls back",
     "its socket; locks of Fast DDS; short locks in callbacks"},
    {kDesk, "desk", 4, "master_io", "reads the input device of who steers without a master arm",
     "the device; locks of Fast DDS for a stop"},
    {kSensing, "sensing", 6, "phantom_sensing",
     "senses at each slave_state, publishes drag_field and percept",
     "the next state; other sensing threads; other processes' shares of the skin, at most `sharing.wait_s`; locks of Fast DDS and a socket's buffer"},
    {kControl, "", 8, "master_io, slave_io, phantom_sensing",
     "the main thread: component_status, commands, notices",
     "locks of Fast DDS; files at start and end; the disk when a stop begins or ends"},
    {kAlerts, "alerts", 8, "phantom_sensing", "publishes hit_alert and model_doubt",
     "locks of Fast DDS; a reader that joins"},
    {kReplies, "replies", 8, "all that take commands; FIFO in master_io, slave_io, phantom_sensing",
     "publishes the replies to commands", "locks of Fast DDS; a reader that joins"},
    {kAudio, "audio", 10, "audio_percept", "makes the sound", "its clock; the audio device"},
    {kDds, "dds", kOrdinary, "all; at niceness −10 in master_io, slave_io, phantom_sensing",
     "the other threads of Fast DDS: discover, time, send again", "sockets; locks of Fast DDS"},
    {kMain, "", kOrdinary, "all others", "the main thread", "anything"},
    {kWorkspace, "workspace", kOrdinary, "phantom_sensing", "assembles the workspace", "its queue's lock"},
    {kViewer, "viewer", kOrdinary, "synthetic_viewer", "draws, at niceness `niceness`",
     "the graphics driver"},
    {kFilm, "film", kOrdinary, "synthetic_viewer",
     "encodes a film, or takes a camera's pictures, at niceness 15", "pictures; files; the camera"},
    {kPictures, "pictures", kOrdinary, "synthetic_viewer", "writes the report's pictures, at niceness 15",
     "files"},
    {kPage, "page", kOrdinary, "synthetic_viewer", "serves the operator's page", "browsers; pictures"},
    {kPageReader, "page_reader", kOrdinary, "synthetic_viewer", "reads the requests to the operator's page",
     "its sockets"},
    {kScene, "scene", kOrdinary, "synthetic_viewer", "composes and sends the scene that browsers draw",
     "its sockets"},
    {kRequests, "requests", kOrdinary, "synthetic_viewer; commands from the shell",
     "asks master and slave until they have answered", "its clock; locks of Fast DDS"},
    {kReadmission, "readmission", kOrdinary, "all", "begins discovery anew with who returned",
     "its clock; sockets"},
    {kStopFile, "stop_file", kOrdinary, "master_io, slave_io",
     "compares the file of the stop with what must stand in it, and writes it again", "files"},
    {kHelper, "helper", kOrdinary, "all that compute in parallel", "shares long computations",
     "its queue's lock"},
    {kOutput, "output", kOrdinary, "all", "writes the log and other lines",
     "standard output and standard error"},
};

}  // namespace

std::span<const ThreadConfig> thread_scheme() noexcept { return kScheme; }

const ThreadConfig& place_of(ThreadRole role) noexcept {
  return *std::find_if(std::begin(kScheme), std::end(kScheme),
                       [role](const ThreadConfig& place) { return place.role == role; });
}

int fifo_priority(ThreadRole role, int servo_priority) noexcept {
  const int below = place_of(role).below_servo;
  return below == kOrdinary || servo_priority <= 0 ? 0 : std::max(1, servo_priority - below);
}

std::string apply_thread_config(ThreadRole role, int servo_priority) {
  const ThreadConfig& place = place_of(role);
  if (place.name[0] != '\0') pthread_setname_np(pthread_self(), place.name);
  sched_param parameters{};
  parameters.sched_priority = fifo_priority(role, servo_priority);
  const int policy = parameters.sched_priority > 0 ? SCHED_FIFO : SCHED_OTHER;
  const int error = pthread_setschedparam(pthread_self(), policy, &parameters);
  if (error == 0) return {};
  return std::string("no real-time priority (") + std::strerror(error) +
         "): expect slips under load; grant CAP_SYS_NICE or an rtprio limit";
}

void run_in_place(ThreadRole role, int servo_priority, const std::function<void()>& work) {
  std::exception_ptr thrown;
  std::thread([&] {
    apply_thread_config(role, servo_priority);
    try {
      work();
    } catch (...) {
      thrown = std::current_exception();
    }
  }).join();
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace phantom::core
