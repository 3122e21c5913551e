#include "components/simulated_drive/eds.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <vector>

#include "common/simulation/local_bus.hpp"

namespace phantom::simulated_drive {
namespace {

using Object = ObjectDictionary::Object;
enum ObjectType { kVar = 0x7, kArray = 0x8, kRecord = 0x9 };

struct Entry {
  const char* name;
  ObjectType type = kVar;
  std::vector<const char*>
      subs;  ///< from sub-index 0; the last one is that of all further ones, with # as their number
};

// Returns the names given in CiA 301 and CiA 402.
const std::map<int, Entry>& entries() {
  static const std::vector<const char*> pdo{"Highest sub-index supported", "COB-ID used by PDO",
                                            "Transmission type"};
  static const std::vector<const char*> mapping{"Number of mapped application objects in PDO",
                                                "Application object #"};
  static const std::map<int, Entry> all = [] {
    std::map<int, Entry> e{
        {0x1000, {"Device type", kVar, {}}},
        {0x1001, {"Error register", kVar, {}}},
        {0x1005, {"COB-ID SYNC", kVar, {}}},
        {0x1008, {"Manufacturer device name", kVar, {}}},
        {0x1014, {"COB-ID EMCY", kVar, {}}},
        {0x1016,
         {"Consumer heartbeat time", kArray, {"Highest sub-index supported", "Consumer heartbeat time"}}},
        {0x1017, {"Producer heartbeat time", kVar, {}}},
        {0x1018, {"Identity object", kRecord, {"Highest sub-index supported", "Vendor-ID"}}},
        {0x2000, {"User label", kVar, {}}},
        {0x6007, {"Abort connection option code", kVar, {}}},
        {0x603F, {"Error code", kVar, {}}},
        {0x6040, {"Controlword", kVar, {}}},
        {0x6041, {"Statusword", kVar, {}}},
        {0x605A, {"Quick stop option code", kVar, {}}},
        {0x605E, {"Fault reaction option code", kVar, {}}},
        {0x6060, {"Modes of operation", kVar, {}}},
        {0x6061, {"Modes of operation display", kVar, {}}},
        {0x6064, {"Position actual value", kVar, {}}},
        {0x6066, {"Following error time out", kVar, {}}},
        {0x606C, {"Velocity actual value", kVar, {}}},
        {0x6071, {"Target torque", kVar, {}}},
        {0x6072, {"Max torque", kVar, {}}},
        {0x6076, {"Motor rated torque", kVar, {}}},
        {0x6077, {"Torque actual value", kVar, {}}},
        {0x607A, {"Target position", kVar, {}}},
        {0x60B2, {"Torque offset", kVar, {}}},
        {0x60C2,
         {"Interpolation time period",
          kRecord,
          {"Highest sub-index supported", "Interpolation time period value", "Interpolation time index"}}},
        {0x60FF, {"Target velocity", kVar, {}}},
        {0x6502, {"Supported drive modes", kVar, {}}},
    };
    for (int i = 0; i < 4; ++i) {
      e[0x1400 + i] = {"RPDO communication parameter", kRecord, pdo};
      e[0x1600 + i] = {"RPDO mapping parameter", kRecord, mapping};
      e[0x1800 + i] = {"TPDO communication parameter", kRecord, pdo};
      e[0x1A00 + i] = {"TPDO mapping parameter", kRecord, mapping};
    }
    return e;
  }();
  return all;
}

template <class... Values>
std::string print(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

// Returns the data type code of CiA 301.
int data_type(const Object& object) {
  if (object.any_length || object.bytes.size() > 4) return 0x0009;  // visible string
  switch (object.bytes.size()) {
    case 1:
      return object.is_signed ? 0x0002 : 0x0005;
    case 2:
      return object.is_signed ? 0x0003 : 0x0006;
    default:
      return object.is_signed ? 0x0004 : 0x0007;
  }
}

// Returns the default value. It compares drives of two neighbouring node ids: a value that differs depends on
// the node id.
std::string default_value(const ObjectDictionary& of_1, const ObjectDictionary& of_2, std::uint32_t key) {
  const auto index = static_cast<std::uint16_t>(key >> 8);
  const auto sub = static_cast<std::uint8_t>(key & 0xFF);
  const Object& object = *of_1.find(index, sub);
  if (data_type(object) == 0x0009) return {object.bytes.begin(), object.bytes.end()};
  const std::int64_t value = of_1.value(index, sub);
  if (of_2.value(index, sub) == value + 1)
    return print("$NODEID+0x%llX", static_cast<unsigned long long>(value - 1));
  return object.is_signed ? print("%lld", static_cast<long long>(value))
                          : print("0x%llX", static_cast<unsigned long long>(value));
}

std::string value_lines(const ObjectDictionary& of_1, const ObjectDictionary& of_2, std::uint32_t key) {
  const Object& object = of_1.objects().at(key);
  std::string text = print("ObjectType=0x%X\nDataType=0x%04X\nAccessType=%s\n", kVar, data_type(object),
                           object.writable ? "rw" : "ro");
  if (object.least != INT64_MIN) text += print("LowLimit=%lld\n", static_cast<long long>(object.least));
  if (object.most != INT64_MAX) text += print("HighLimit=%lld\n", static_cast<long long>(object.most));
  return text + "DefaultValue=" + default_value(of_1, of_2, key) +
         print("\nPDOMapping=%d\n", object.mappable ? 1 : 0);
}

std::string sub_name(const Entry& entry, std::size_t sub) {
  std::string name = entry.subs[std::min(sub, entry.subs.size() - 1)];
  if (name.back() == '#') name.replace(name.size() - 1, 1, std::to_string(sub));
  return name;
}

// Returns the sections of one index: the object, and its sub-indices if it is not a plain variable.
std::string sections(const ObjectDictionary& of_1, const ObjectDictionary& of_2, int index) {
  const auto known = entries().find(index);
  if (known == entries().end()) throw std::logic_error(print("object 0x%04X has no name for the EDS", index));
  const Entry& entry = known->second;
  const auto first = static_cast<std::uint32_t>(index) << 8;
  std::string text = print("\n[%X]\nParameterName=%s\n", index, entry.name);
  if (entry.type == kVar) return text + value_lines(of_1, of_2, first);
  std::string subs;
  int count = 0;
  for (auto at = of_1.objects().lower_bound(first);
       at != of_1.objects().end() && at->first >> 8 == first >> 8; ++at) {
    const std::uint32_t sub = at->first & 0xFF;
    subs += print("\n[%Xsub%X]\nParameterName=%s\n", index, sub, sub_name(entry, sub).c_str()) +
            value_lines(of_1, of_2, at->first);
    ++count;
  }
  return text + print("ObjectType=0x%X\nSubNumber=%d\n", entry.type, count) + subs;
}

std::string list(const char* name, const std::vector<int>& indices) {
  std::string text = print("\n[%s]\nSupportedObjects=%zu\n", name, indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) text += print("%zu=0x%04X\n", i + 1, indices[i]);
  return text;
}

std::string head(const DriveOptions& options) {
  std::string text =
      "[FileInfo]\nFileName=simulated_drive.eds\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\n"
      "Description=CiA 402 servo drive without hardware\nCreationTime=12:00AM\nCreationDate=01-01-2026\n"
      "CreatedBy=simulated_drive --eds\nModificationTime=12:00AM\nModificationDate=01-01-2026\n"
      "ModifiedBy=simulated_drive --eds\n\n"
      "[DeviceInfo]\nVendorName=Phantom\nVendorNumber=0x0\nProductName=" +
      options.device_name + "\nProductNumber=0x0\nRevisionNumber=0x0\nOrderCode=\n";
  for (const int kbit_s : {10, 20, 50, 125, 250, 500, 800, 1000}) text += print("BaudRate_%d=1\n", kbit_s);
  return text +
         "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=8\nDynamicChannelsSupported=0\nCompactPDO=0\n"
         "GroupMessaging=0\nNrOfRXPDO=4\nNrOfTXPDO=4\nLSS_Supported=0\n\n"
         "[DummyUsage]\nDummy0001=0\nDummy0002=0\nDummy0003=0\nDummy0004=0\nDummy0005=0\nDummy0006=0\nDummy0007=0\n\n"
         "[Comments]\nLines=0\n";
}

}  // namespace

std::string eds_text(const DriveOptions& options) {
  simulation::LocalBus bus;
  DriveOptions first = options, second = options;
  first.node = 1, second.node = 2;
  const SimulatedDrive drive_1(first, bus.connect("1")), drive_2(second, bus.connect("2"));
  const ObjectDictionary &of_1 = drive_1.dictionary(), &of_2 = drive_2.dictionary();
  std::vector<int> mandatory, optional, manufacturer;
  for (const auto& [key, object] : of_1.objects()) {
    const int index = static_cast<int>(key >> 8);
    auto& kind = index == 0x1000 || index == 0x1001 || index == 0x1018 ? mandatory
                 : index >= 0x2000 && index < 0x6000                   ? manufacturer
                                                                       : optional;
    if (kind.empty() || kind.back() != index) kind.push_back(index);
  }
  std::string text = head(options);
  for (const auto& [name, indices] :
       {std::pair{"MandatoryObjects", mandatory}, std::pair{"OptionalObjects", optional},
        std::pair{"ManufacturerObjects", manufacturer}}) {
    text += list(name, indices);
    for (const int index : indices) text += sections(of_1, of_2, index);
  }
  return text;
}

}  // namespace phantom::simulated_drive
