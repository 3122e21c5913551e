// Cyclone DDS's descriptions of the project's types, as its compiler makes them from idl/. Plain C, so that the generated
// headers of two vendors never meet in one file.
#pragma once

#include <dds/dds.h>

#ifdef __cplusplus
extern "C" {
#endif

struct cyclone_type {
  const char* name;  // "phantom::msg::Percept"
  const dds_topic_descriptor_t* descriptor;
};

// Ended by an entry without a name.
extern const struct cyclone_type cyclone_types[];

#ifdef __cplusplus
}
#endif
