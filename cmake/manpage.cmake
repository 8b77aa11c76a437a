# The man page from docs/dlmfd.1.in: the keys from docs/options.md, the tools from their first lines, the date from CHANGELOG.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS docs/options.md ${DLM_TOOLS})

# roff(<variable>): what roff would take for commands of its own.
function(roff variable)
  string(REPLACE "\\" "\\e" text "${${variable}}")
  string(REPLACE "-" "\\-" text "${text}")
  set(${variable} "${text}" PARENT_SCOPE)
endfunction()

file(READ docs/options.md keys)
string(FIND "${keys}" "\n## " start)
string(SUBSTRING "${keys}" ${start} -1 keys)
roff(keys)
string(REGEX REPLACE "\n\\|[^`\n]*\\|\n[^`\n]*\\|\n" "\n" keys "${keys}") # heads of the tables
string(REGEX REPLACE "\n+## ([^\n]*)\n" "\n.SS \\1" keys "${keys}")
string(REGEX REPLACE "\n\\| `([^`]*)` \\| ([^|]*) \\| ([^|]*) \\| ([^|]*) \\| ([^\n]*) \\|" "\n.TP\n.BR \\1 \" (\\2)\"\n\\5.\nAllowed: \\3; unit: \\4." keys "${keys}")
string(REPLACE "; unit: ." "." keys "${keys}")
string(STRIP "${keys}" DLM_KEYS)

set(DLM_COMMANDS "")
foreach(tool ${DLM_TOOLS})
  file(READ ${tool} text LIMIT 400)
  string(REGEX MATCH "\"\"\"([^\n]*)" text "${text}")
  set(text "${CMAKE_MATCH_1}")
  get_filename_component(name ${tool} NAME)
  string(REPLACE _ - name dlmfd-${name})
  roff(name)
  roff(text)
  string(APPEND DLM_COMMANDS ".TP\n.B ${name}\n${text}\n")
endforeach()
string(STRIP "${DLM_COMMANDS}" DLM_COMMANDS)

file(STRINGS CHANGELOG dates REGEX "^ -- ")
list(GET dates 0 date)
string(REGEX MATCH "[0-9]+ [A-Z][a-z][a-z] [0-9]+" DLM_DATE "${date}")
configure_file(docs/dlmfd.1.in ${made}/dlmfd.1 @ONLY)
