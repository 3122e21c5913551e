#include "common/diagnostics/qos.hpp"

#include <fnmatch.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/core/text.hpp"

namespace phantom::diagnostics {
namespace {

std::string to_string(DestinationOrder value) {
  return value == DestinationOrder::kByReception ? "by reception timestamp" : "by source timestamp";
}

std::string to_string(AccessScope value) {
  constexpr const char* kNames[] = {"instance", "topic", "group"};
  return kNames[static_cast<int>(value)];
}

std::string liveliness_text(const EndpointQos& qos) {
  return to_string(qos.liveliness) + ", lease " + duration_text(qos.lease_ns);
}

std::string presentation_text(const EndpointQos& qos) {
  return to_string(qos.access_scope) + (qos.coherent_access ? ", coherent" : "") +
         (qos.ordered_access ? ", ordered" : "");
}

Representation written(const EndpointQos& qos) {
  return qos.representations.empty() ? Representation::kXcdr1 : qos.representations.front();
}

std::string representations_text(const EndpointQos& qos) {
  if (qos.representations.empty()) return to_string(Representation::kXcdr1);
  std::string text;
  for (const auto value : qos.representations) text += (text.empty() ? "" : " or ") + to_string(value);
  return text;
}

bool reads(const EndpointQos& qos, Representation representation) {
  const auto& list = qos.representations;
  if (list.empty()) return representation == Representation::kXcdr1;
  return std::find(list.begin(), list.end(), representation) != list.end();
}

bool name_matches(const std::string& a, const std::string& b) {
  return fnmatch(a.c_str(), b.c_str(), 0) == 0 || fnmatch(b.c_str(), a.c_str(), 0) == 0;
}

}  // namespace

bool share_a_partition(std::vector<std::string> a, std::vector<std::string> b) {
  if (a.empty()) a.emplace_back();
  if (b.empty()) b.emplace_back();
  return std::any_of(a.begin(), a.end(), [&](const std::string& x) {
    return std::any_of(b.begin(), b.end(), [&](const std::string& y) {
      return x == y || (!x.empty() && !y.empty() && name_matches(x, y));
    });
  });
}

std::string duration_text(std::int64_t duration_ns) {
  if (duration_ns == kInfinite_ns) return "none";
  const double s = static_cast<double>(duration_ns) * 1e-9;
  if (duration_ns == 0) return "0 ms";
  if (s < 1e-3) return fmt::format("{:g} µs", s * 1e6);
  return s < 1.0 ? fmt::format("{:g} ms", s * 1e3) : fmt::format("{:g} s", s);
}

std::string to_string(Reliability value) {
  return value == Reliability::kReliable ? "reliable" : "best effort";
}

std::string to_string(Durability value) {
  constexpr const char* kNames[] = {"volatile", "transient local", "transient", "persistent"};
  return kNames[static_cast<int>(value)];
}

std::string to_string(Liveliness value) {
  constexpr const char* kNames[] = {"automatic", "manual by participant", "manual by topic"};
  return kNames[static_cast<int>(value)];
}

std::string to_string(Ownership value) { return value == Ownership::kShared ? "shared" : "exclusive"; }

std::string to_string(Representation value) {
  return value == Representation::kXcdr1 ? "XCDR1" : value == Representation::kXcdr2 ? "XCDR2" : "XML";
}

std::string partitions_text(const std::vector<std::string>& partitions) {
  if (partitions.empty()) return "default";
  return core::listed(partitions,
                      [](const std::string& name) { return name.empty() ? "default" : "'" + name + "'"; });
}

std::string qos_text(const EndpointQos& qos) {
  std::string text = to_string(qos.reliability) + ", " + to_string(qos.durability);
  if (qos.deadline_ns != kInfinite_ns) text += ", deadline " + duration_text(qos.deadline_ns);
  if (qos.liveliness != Liveliness::kAutomatic || qos.lease_ns != kInfinite_ns)
    text += ", liveliness " + liveliness_text(qos);
  if (qos.lifespan_ns != kInfinite_ns) text += ", lifespan " + duration_text(qos.lifespan_ns);
  if (qos.latency_budget_ns != 0) text += ", latency budget " + duration_text(qos.latency_budget_ns);
  if (qos.ownership != Ownership::kShared) text += ", ownership " + to_string(qos.ownership);
  if (qos.destination_order != DestinationOrder::kByReception)
    text += ", order " + to_string(qos.destination_order);
  if (qos.access_scope != AccessScope::kInstance || qos.coherent_access || qos.ordered_access)
    text += ", presentation " + to_string(qos.access_scope) + (qos.coherent_access ? " coherent" : "") +
            (qos.ordered_access ? " ordered" : "");
  if (!qos.partitions.empty()) text += ", partition " + partitions_text(qos.partitions);
  if (written(qos) != Representation::kXcdr1) text += ", " + representations_text(qos);
  return text;
}

std::vector<Mismatch> mismatches(const EndpointQos& offered, const EndpointQos& requested) {
  std::vector<Mismatch> found;
  const auto check = [&](bool matches, const char* policy, auto&& text, std::string rule,
                         std::string advice) {
    if (!matches)
      found.push_back({policy, text(offered), text(requested), std::move(rule), std::move(advice)});
  };
  const auto name = [](auto EndpointQos::*policy) {
    return [policy](const EndpointQos& qos) { return to_string(qos.*policy); };
  };
  const auto duration = [](std::int64_t EndpointQos::*policy) {
    return [policy](const EndpointQos& qos) { return duration_text(qos.*policy); };
  };
  check(offered.reliability >= requested.reliability, "reliability", name(&EndpointQos::reliability),
        "a reader that wants every sample needs a writer that repeats lost ones",
        "make the writer reliable, or the reader best effort");
  check(offered.durability >= requested.durability, "durability", name(&EndpointQos::durability),
        "the reader wants what was written before it came, and the writer does not keep it",
        "make the writer " + to_string(requested.durability) + ", or the reader " +
            to_string(offered.durability));
  check(offered.deadline_ns <= requested.deadline_ns, "deadline", duration(&EndpointQos::deadline_ns),
        "the writer does not promise samples as often as the reader wants them",
        "give the writer a deadline of at most " + duration_text(requested.deadline_ns) +
            " (and keep it), or the reader " +
            (offered.deadline_ns == kInfinite_ns ? "none"
                                                 : "one of at least " + duration_text(offered.deadline_ns)));
  check(offered.latency_budget_ns <= requested.latency_budget_ns, "latency budget",
        duration(&EndpointQos::latency_budget_ns),
        "the writer may hold samples back for longer than the reader allows",
        "lower the writer's latency budget to " + duration_text(requested.latency_budget_ns) +
            ", or raise the reader's");
  check(offered.liveliness >= requested.liveliness && offered.lease_ns <= requested.lease_ns, "liveliness",
        liveliness_text,
        offered.liveliness < requested.liveliness
            ? "the reader wants a stronger proof of life than the writer gives"
            : "the writer proves that it lives less often than the reader wants",
        "give the writer the reader's kind and at most its lease, or ask for less at the reader");
  check(offered.ownership == requested.ownership, "ownership", name(&EndpointQos::ownership),
        "ownership must be the same at both ends", "choose one kind for the topic");
  check(offered.destination_order >= requested.destination_order, "destination order",
        name(&EndpointQos::destination_order), "samples can be ordered by source only if the writer says so",
        "set it at the writer too, or not at the reader");
  check(offered.access_scope >= requested.access_scope &&
            (offered.coherent_access || !requested.coherent_access) &&
            (offered.ordered_access || !requested.ordered_access),
        "presentation", presentation_text,
        "the reader wants sets of changes kept together or in order that the writer does not mark",
        "give the writer's publisher the presentation that the reader's subscriber asks for");
  check(
      share_a_partition(offered.partitions, requested.partitions), "partition",
      [](const EndpointQos& qos) { return partitions_text(qos.partitions); },
      "they have no partition in common: separated on purpose, or a name is mistyped",
      "if they should meet, give both the same partition");
  check(
      reads(requested, written(offered)), "data representation",
      [&](const EndpointQos& qos) {
        return &qos == &offered ? to_string(written(qos)) : representations_text(qos);
      },
      "the reader does not read the encoding that the writer writes",
      "let the writer offer " + to_string(Representation::kXcdr1) + ", which every vendor reads");
  return found;
}

}  // namespace phantom::diagnostics
