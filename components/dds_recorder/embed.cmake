# cmake -DFOLDER=idl -DOUT=idl_files.cpp -P embed.cmake: writes the topics' IDL files as string constants.
set(code "// Made from idl/ by embed.cmake.\n#include \"components/dds_recorder/idl_files.hpp\"\n\n")
string(APPEND code "namespace phantom::dds_recorder {\nconst std::array<IdlFile, 6> kIdlFiles{{\n")
foreach(file types teleoperation percept workspace status haptic_device)
  file(READ "${FOLDER}/${file}.idl" text)
  string(APPEND code "{\"${file}.idl\", R\"__idl__(${text})__idl__\"},\n")
endforeach()
string(APPEND code "}};\n}\n")
file(WRITE "${OUT}" "${code}")
