#include "components/workspace_survey/commands.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <ostream>

#include "common/messages/ask.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/configuration/pose_text.hpp"
#include "common/runtime/process/process.hpp"
#include "common/survey/visible.hpp"
#include "components/workspace_survey/assist.hpp"
#include "components/workspace_survey/head/simulated_head.hpp"
#include "components/workspace_survey/measurement_file.hpp"
#include "components/workspace_survey/object_text.hpp"
#include "components/workspace_survey/page/candidates_page.hpp"
#include "components/workspace_survey/page/survey_page.hpp"
#include "components/workspace_survey/part_picture.hpp"
#include "components/workspace_survey/picture.hpp"
#include "components/workspace_survey/touch_command.hpp"

namespace phantom::workspace_survey {
namespace {

using core::ConfigError;

void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream stream(file, std::ios::binary);
  stream << bytes;
  if (!stream.flush()) throw ConfigError(file.string() + ": cannot be written");
}

Library read_library(const std::filesystem::path& folder) {
  Library library = load_library(folder);
  for (const LibraryPart& part : library.parts) {
    for (const std::string& note : part.notes) spdlog::warn("part {}: {}", part.name, note);
  }
  for (const UnusablePart& part : library.unusable)
    spdlog::warn("{}; it is left out, and is not recognised", part.problem);
  return library;
}

geometry::Pose pose_of(const Request& request) {
  const auto pose = runtime::parse_pose(request.pose);
  if (!pose) throw ConfigError("--pose: " + pose.status().message());
  return *pose;
}

/// Adds the requested errors to ranges, to try the error aid.
void add_range_errors(const std::vector<std::string>& range_errors,
                      std::vector<survey::Targeting>& targetings) {
  for (const std::string& text : range_errors) {
    const auto at = text.find('=');
    const double error_mm = at == std::string::npos
                                ? std::nan("")
                                : runtime::number_of(text.substr(at + 1)).value_or(std::nan(""));
    const auto hit = std::find_if(targetings.begin(), targetings.end(),
                                  [&](const auto& t) { return t.node == text.substr(0, at) && t.reading; });
    if (!(std::abs(error_mm) < 1e5) || hit == targetings.end())
      throw ConfigError("--range-error: '" + text + "'; allowed: NODE=MM, with a node that is measured");
    hit->reading->range_m += 1e-3 * error_mm;
  }
}

/// Returns the head as it is really mounted in a simulation.
survey::RangeHead simulated_mounting(const Request& request, const Config& config) {
  std::mt19937_64 random(~std::uint64_t{request.seed});
  return survey::simulate_mounting(config.head, config.errors, random);
}

std::vector<survey::Targeting> simulated(const Request& request, const Config& config,
                                         const Library& library) {
  if (request.pose.empty())
    throw ConfigError(
        "--pose: is missing: where the simulated part stands; allowed: \"x y z roll pitch yaw\", for "
        "instance \"0.1 0 0.4 90 0 20\"");
  const survey::PartModel& part = library.models[find_part(library, request.part)];
  const geometry::Pose X_WO = pose_of(request);
  survey::VisibleOptions options;
  options.most_faces = static_cast<std::size_t>(request.faces);
  const auto faces = survey::visible_faces(part, X_WO, config.head.X_WH.translation_m, options);
  if (faces.empty())
    throw ConfigError("--pose: the head sees no face of " + part.name +
                      " there whose corners it could target");
  std::mt19937_64 random(request.seed);
  auto targetings = survey::simulate_targetings(part, X_WO, faces, simulated_mounting(request, config),
                                                config.errors, random);
  if (!targetings) throw ConfigError("--pose: " + targetings.status().message());
  add_range_errors(request.range_errors, *targetings);
  return *targetings;
}

std::string origin_text(const Request& request, const Config& config) {
  return fmt::format(
      "{} at \"{}\" (x y z in m, roll pitch yaw in deg), simulated with seed {}\nhead at \"{}\", "
      "beam offset {:.1f} mm",
      request.part, request.pose, request.seed, runtime::pose_text(config.head.X_WH),
      1e3 * config.head.beam_offset_m);
}

/// Lists the library's parts, and writes a picture of each.
int list_parts(const Request& request, const Config& config, std::ostream& print) {
  const Library library = read_library(request.library);
  print << parts_text(library, 2.0 * config.errors.range_m);
  if (request.out.empty()) return runtime::kExitDone;
  std::error_code failed;  // told by the first picture that cannot be written
  std::filesystem::create_directories(request.out, failed);
  for (const survey::PartModel& model : library.models) {
    if (model.name.find('/') != std::string::npos)
      throw ConfigError("part '" + model.name + "': no file can be called so; allowed: a name without '/'");
    const auto png = part_picture(model);
    write_file(request.out / (model.name + ".png"), {png.begin(), png.end()});
  }
  print << fmt::format("{}: {} pictures\n", request.out.string(), library.models.size());
  return runtime::kExitDone;
}

int simulate(const Request& request, const Config& config, std::ostream& print) {
  const auto targetings = simulated(request, config, read_library(request.library));
  std::ostringstream text;
  write_measurements(text, targetings, origin_text(request, config));
  if (request.out.empty()) {
    print << text.str();
  } else {
    write_file(request.out, text.str());
    print << fmt::format("{}: {} targetings\n", request.out.string(), targetings.size());
  }
  return runtime::kExitDone;
}

/// Drives a simulated head over the cell's real objects, and a part of the library if one is asked for.
int simulate_head(const Request& request, const Config& config, const Workspace& workspace, std::istream& in,
                  std::ostream& print) {
  geometry::TriangleMesh scene_W;
  for (const auto& body : runtime::load_real_bodies(workspace.cell)) scene_W.append(body.mesh_W);
  for (const auto& body : runtime::load_loose_bodies(workspace.cell))
    scene_W.append(body.mesh_O.transformed(body.X_WO));
  if (!request.part.empty()) {
    const Library library = read_library(request.library);
    scene_W.append(library.models[find_part(library, request.part)].mesh_O.transformed(pose_of(request)));
  }
  survey::SimulatedRanger ranger(simulated_mounting(request, config), config.errors,
                                 survey::RangerScene(scene_W), request.seed);
  run_simulated_head(ranger, in, print);
  return runtime::kExitDone;
}

/// Sends a fitted object to wva_server; returns its final reply, or none if it does not answer.
std::optional<messages::WorkspaceReply> send_object(const Request& request, const Workspace& workspace,
                                                    const SurveyReport& report) {
  const survey::FittedObject& object = *report.result.object;
  const LibraryPart& part = report.library.parts[object.part];
  const int guard = guard_of(report);
  if (guard > 100)
    throw ConfigError(fmt::format("the guard is {} voxels of {}; allowed: at most 100", guard,
                                  guard_voxel_text(report.voxel_size_m)));
  messages::WorkspaceCommand command;
  if (request.move.empty()) {
    command.operation = messages::WorkspaceOperation::kAdd;
    command.description =
        object_text(part, report.library.models[object.part], request.name.empty() ? part.name : request.name,
                    object.fit.X_WO, guard);
  } else {
    command.operation = messages::WorkspaceOperation::kMove;
    command.object = request.move;
    command.X_WO = object.fit.X_WO;
    command.guard_vox = static_cast<std::uint16_t>(guard);
  }
  return messages::ask(workspace.network, "workspace_survey", command, request.timeout_s);
}

std::string reply_text(const std::optional<messages::WorkspaceReply>& reply, const Request& request,
                       const Workspace& workspace, const char* done = "workspace: ") {
  if (!reply)
    return fmt::format(
        "no answer from wva_server in domain {} for {} s; is it running, and is this its deployment?",
        workspace.network.domain, request.timeout_s);
  return (reply->outcome == messages::WorkspaceOutcome::kDone ? done : "workspace refused: ") +
         reply->message;
}

int exit_code_of(const std::optional<messages::WorkspaceReply>& reply) {
  if (!reply) return runtime::kExitMissing;
  return reply->outcome == messages::WorkspaceOutcome::kDone ? runtime::kExitDone : runtime::kExitFailed;
}

int send(const Request& request, const Workspace& workspace, const SurveyReport& report,
         std::ostream& print) {
  const auto reply = send_object(request, workspace, report);
  print << reply_text(reply, request, workspace, "workspace:   ") << '\n';  // below the report's other lines
  if (exit_code_of(reply) == runtime::kExitDone) print << "version " << reply->version << '\n';
  return exit_code_of(reply);
}

/// Returns what a person types to choose, up to the number.
std::string pick_command(const Request& request) {
  return "workspace_survey fit --measurements " + request.measurements.string() +
         (request.part.empty() ? "" : " --part " + request.part) + " --pick ";
}

workspace::VoxelSize voxel_size_of(const Request& request, const Workspace& workspace) {
  return request.voxel_size_mm > 0 ? workspace::VoxelSize(1e-3 * request.voxel_size_mm)
                                   : workspace.voxel_size_m;
}

int fit(const Request& request, const Config& config, const Workspace& workspace, std::ostream& print) {
  Library library = read_library(request.library);
  if (!request.part.empty()) {
    const std::size_t only = find_part(library, request.part);
    library.parts = {library.parts[only]};
    library.models = {library.models[only]};
  }
  const auto measurement =
      survey::register_nodes(config.head, config.errors, read_measurements(request.measurements));
  if (!measurement) throw ConfigError(measurement.status().message());
  survey::SurveyOptions options = config.options;
  options.picked = request.pick;
  const auto result = survey::survey_object(library.models, *measurement, options);
  const SurveyReport report{config, library, *measurement, result, voxel_size_of(request, workspace)};
  if (request.json == "-") {
    print << json_text(report);
  } else {
    print << measured_text(report) << candidates_text(report) << alternatives_text(report);
    if (request.what == "fit" || !result.refusal.empty()) print << fit_text(report);
    if (!request.json.empty()) write_file(request.json, json_text(report));
  }
  if (!request.page.empty())
    write_file(request.page, candidates_page(report, pick_command(request), request.view));
  if (request.what == "identify")
    return result.identification.candidates.empty() ? runtime::kExitFailed : runtime::kExitDone;
  if (!result.object) return runtime::kExitFailed;
  if (!request.picture.empty()) {
    const auto png = residual_picture(report);
    write_file(request.picture, {png.begin(), png.end()});
  }
  return request.send ? send(request, workspace, report, print) : runtime::kExitDone;
}

/// Shows what agrees where the request says. Returns what the person is told.
std::string show_candidates(const Request& request, const SurveyReport& report, SurveyPage* page) {
  std::string told;
  if (page != nullptr) {
    page->show_candidates(candidates_page(report, "", request.view));
    told = "  to pick one, see below the dialogue\n";
  }
  if (request.page.empty()) return told;
  write_file(request.page, candidates_page(report, "pick ", request.view));
  return told + "  to see them, and to pick one: " + request.page.string() + " in a browser (reload it)\n";
}

int run_assistant(const Request& request, const Config& config, const Workspace& workspace, std::istream& in,
                  std::ostream& print) {
  const Library library = read_library(request.library);
  AssistSetup setup;
  setup.voxel_size_m = voxel_size_of(request, workspace);
  if (!request.part.empty()) setup.practice = simulated(request, config, library);
  std::optional<HeadDriver> head;
  if (!request.driver.empty()) {
    head.emplace(request.driver, config.head, request.driver_timeout_s);
    setup.head = &*head;
    setup.readings = request.readings;
  }
  setup.save = [](const std::string& file, const std::vector<survey::Targeting>& targetings) {
    std::ofstream stream(file);
    write_measurements(stream, targetings, "measured with workspace_survey assist");
    return stream.flush() ? "kept in " + file : file + " cannot be written";
  };
  std::optional<SurveyPage> page;
  if (request.serve) {
    page.emplace(*request.serve, print);
    print << "The dialogue is on the page " << page->url() << "\nThis terminal shows it; Ctrl-C ends it.\n"
          << std::flush;
    setup.on_prompt = [&page](const AssistView& view) { page->show(view); };
  }
  if (page || !request.page.empty())
    setup.show = [&](const SurveyReport& report) {
      return show_candidates(request, report, page ? &*page : nullptr);
    };
  setup.send = [&](const SurveyReport& report) {
    const auto reply = send_object(request, workspace, report);
    return Sent{reply_text(reply, request, workspace), exit_code_of(reply)};
  };
  if (page) return assist(config, library, setup, page->lines(), page->words());
  return assist(config, library, setup, in, print);
}

void add_target_options(runtime::Command app, Request& request) {
  app.option("--pose", request.pose,
             "\"x y z roll pitch yaw\": where the simulated part stands in W, metres and degrees");
  app.option("--faces", request.faces, "how many faces of it are measured, those that look largest first")
      .between(1, 6);
  app.option("--seed", request.seed, "of the simulated errors");
  app.option("--range-error", request.range_errors,
             "NODE=MM: an error of its own on a node's range, to try the error aid");
}

void add_simulated_head_options(runtime::Command app, Request& request) {
  app.option("--part", request.part, "a part of the library that stands in the cell, too, at --pose");
  app.option("--pose", request.pose, "\"x y z roll pitch yaw\" of that part in W, metres and degrees");
  app.option("--seed", request.seed, "of the simulated errors, that of the head's mounting among them");
}

void add_driver_options(runtime::Command app, Request& request) {
  app.option("--driver", request.driver,
             "a line of shell that starts the driver of a range head, to be steered from here "
             "(docs/range_head.md); \"workspace_survey simulate_head\" is one");
  app.option("--driver-timeout-s", request.driver_timeout_s, "how long to wait for each of its answers")
      .between(0.1, 3600.0);
  app.option("--readings", request.readings, "of each corner by that head: they are averaged")
      .between(1, kMaxHeadReadings);
}

void add_send_options(runtime::Command app, Request& request) {
  app.option("--name", request.name, "what the object is called in the workspace; default: as the part");
  app.option("--move", request.move,
             "an object of the workspace that this is: it is moved, instead of adding one");
  app.option("--timeout-s", request.timeout_s, "how long to wait for an answer of wva_server")
      .between(0.1, 3600.0);
  app.option("--voxel-size-mm", request.voxel_size_mm,
             "for the guard; default: that of the deployment's cell")
      .between(0.1, 1000.0);
}

void add_page_options(runtime::Command app, Request& request) {
  app.option(
      "--page", request.page,
      "write a page (HTML) with every candidate rendered as the head sees it, to turn and to pick one");
  app.option("--view", request.view, "for that page: a picture of the cell as it is seen now, PNG or JPEG");
}

void add_touch_options(runtime::Command app, Request& request) {
  runtime::Command touch = app.subcommand(
      "touch", "correct an object's pose by touching it with the arm; shows the change and asks");
  touch.on_use([&request] { request.what = "touch"; });
  touch.option("--object", request.object, "which object of the workspace is touched").required();
  touch.option("--arm", request.arm, "which of the cell's arms touches; default: the only one");
  touch.option("--touches", request.touches, "after so many the change is proposed").between(1, 1000);
  touch.flag(
      "--kept", request.kept,
      "begin with the places where the arm's contacts have contradicted the model (topic model_doubt)");
  touch
      .option("--tip-radius-mm", request.tip_radius_mm,
              "a probing tool is mounted: the radius of its ball, whose centre is the arm's tip frame; "
              "without it the arm must say where it is touched")
      .between(0.0, 1000.0);
  touch.option("--wait-s", request.wait_s, "for the next contact; then with those that came")
      .between(0.1, 36000.0);
  touch.option("--timeout-s", request.timeout_s, "how long to wait for the system's answers")
      .between(0.1, 3600.0);
  touch.flag("--apply", request.apply, "apply the change without asking");
  touch.option("--json", request.json,
               "write the result as JSON to this file; -: instead of the text, without asking");
}

}  // namespace

void add_options(runtime::Command app, Request& request) {
  app.text_flag("--help-library", kPartKeys, "print every key of a library of parts with range and meaning");
  const auto sub = [&](const char* name, const char* summary) {
    runtime::Command added = app.subcommand(name, summary);
    added.on_use([&request, name] { request.what = name; });
    added.option("--library", request.library, "folder of CAD models; default: the shipped parts");
    return added;
  };
  sub("parts", "list the library's parts, with what tells them apart")
      .option("--pictures", request.out, "write a picture of each, made from its mesh, into this folder");
  runtime::Command simulate = sub("simulate", "measure a part with the simulated range head, as CSV");
  simulate.option("--part", request.part, "which part of the library").required();
  add_target_options(simulate, request);
  simulate.option("--out", request.out, "file to write; default: standard output");
  for (const char* name : {"identify", "fit"}) {
    const bool is_fit = std::string(name) == "fit";
    runtime::Command reads =
        sub(name, is_fit ? "find what was measured and where it stands; tell the workspace with --send"
                         : "list the parts that agree with what was measured");
    reads
        .option("--measurements", request.measurements,
                "CSV: face, part, node, range_mm, pan_deg, tilt_deg (or range_m, pan_rad, tilt_rad)")
        .required();
    reads.option("--part", request.part, "look at this part of the library only");
    reads.option("--json", request.json, "write the result as JSON to this file; -: instead of the text");
    add_page_options(reads, request);
    if (!is_fit) continue;
    reads
        .option("--pick", request.pick, "which of several alternatives it is, by a person's eyes; see --page")
        .between(1, 100000);
    reads.option("--picture", request.picture, "write a PNG of the residuals");
    reads.flag("--send", request.send, "add the object to the running workspace, or move one (--move)");
    add_send_options(reads, request);
  }
  runtime::Command assist = sub("assist", "be led through targeting, corner by corner");
  assist.option("--practice", request.part,
                "no head at hand: a simulated one targets this part of the library, at --pose");
  add_target_options(assist, request);
  add_driver_options(assist, request);
  assist
      .option(
          "--serve", request.serve,
          "PORT: lead the dialogue on a page in a browser on this host, instead of in the terminal; 0: any "
          "free port")
      .between(0, 65535);
  add_page_options(assist, request);
  add_send_options(assist, request);
  add_simulated_head_options(
      sub("simulate_head",
          "be the driver of a simulated range head in the deployment's cell (assist --driver)"),
      request);
  add_touch_options(app, request);
}

int run(const Request& request, const Config& config, const Workspace& workspace, std::istream& in,
        std::ostream& print) {
  Request whole = request;
  if (whole.library.empty()) whole.library = runtime::share_path("deploy/parts");
  if (whole.what == "parts") return list_parts(whole, config, print);
  if (whole.what == "simulate") return simulate(whole, config, print);
  if (whole.what == "touch") return run_touch(whole, config, workspace, in, print);
  if (whole.what == "simulate_head") return simulate_head(whole, config, workspace, in, print);
  if (whole.what == "assist") return run_assistant(whole, config, workspace, in, print);
  return fit(whole, config, workspace, print);
}

}  // namespace phantom::workspace_survey
