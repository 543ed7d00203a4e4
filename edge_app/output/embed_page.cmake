# cmake -DPAGE=page -DNAME=status_page -DSTYLE=style.css "-DMODULES=numbers;...;main" -DHEADER=edge_app/output/status_page.h
#       -DPOLICY=kStatusPagePolicy -DSOURCE=status_page_text.cpp -P embed_page.cmake
# Joins the files of the folder `page` into one page and writes it into a C++ source, together with a
# Content-Security-Policy. The policy allows the page's style and script by their SHA-256, and nothing
# from elsewhere. The modules become one script, in their order, without imports and exports.
cmake_minimum_required(VERSION 3.16)
include("${CMAKE_CURRENT_LIST_DIR}/text_pieces.cmake")
file(READ "${PAGE}/${NAME}.html" page)
file(READ "${STYLE}" style)
set(style "\n${style}")

set(script "\n'use strict';\n")
foreach(module ${MODULES})
  file(READ "${PAGE}/${module}.js" text)
  set(text "\n${text}")
  string(REGEX REPLACE "\nimport {[^}]*} from '[^']*';" "" text "${text}")
  string(REPLACE "\nexport " "\n" text "${text}")
  string(APPEND script "${text}")
endforeach()

# Puts a text in place of a line of the page, which must occur once.
function(replace_line line text)
  string(FIND "${page}" "${line}" first)
  string(FIND "${page}" "${line}" last REVERSE)
  if(first EQUAL -1 OR NOT first EQUAL last)
    message(FATAL_ERROR "${PAGE}/${NAME}.html: should have ${line} once")
  endif()
  string(REPLACE "${line}" "${text}" page "${page}")
  set(page "${page}" PARENT_SCOPE)
endfunction()

# A SHA-256 as a policy has it: 256 bits and two zero bits are 43 digits of base64.
function(policy_hash text result)
  set(digits "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/")
  string(SHA256 hex "${text}")
  set(hash "")
  foreach(from RANGE 0 63 3)
    string(SUBSTRING "${hex}00" ${from} 3 part)
    math(EXPR high "0x${part} / 64")
    math(EXPR low "0x${part} % 64")
    string(SUBSTRING "${digits}" ${high} 1 high)
    string(SUBSTRING "${digits}" ${low} 1 low)
    string(APPEND hash "${high}${low}")
  endforeach()
  string(SUBSTRING "${hash}" 0 43 hash)
  set(${result} "'sha256-${hash}='" PARENT_SCOPE)
endfunction()

replace_line("<link rel=\"stylesheet\" href=\"style.css\">" "<style>${style}</style>")
replace_line("<script type=\"module\" src=\"main.js\"></script>" "<script>${script}</script>")
policy_hash("${style}" style_hash)
policy_hash("${script}" script_hash)
set(policy "default-src 'none'; style-src ${style_hash}; script-src ${script_hash}; connect-src 'self'; img-src data:; ")
string(APPEND policy "base-uri 'none'; form-action 'none'; frame-ancestors 'none'")

text_pieces("${page}" "${PAGE}" pieces)

file(WRITE "${SOURCE}" "#include \"${HEADER}\"

namespace alidade {

const char* const ${POLICY} = R\"page(${policy})page\";

std::string ${NAME}_text() {
  std::string text;
${pieces}  return text;
}

}  // namespace alidade
")
