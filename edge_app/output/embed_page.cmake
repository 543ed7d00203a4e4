# cmake -DPAGE=status_page.html -DSOURCE=status_page_text.cpp -P embed_page.cmake
# Writes the page into a C++ source, together with a Content-Security-Policy. The policy allows the
# page's style and script by their SHA-256, and nothing from elsewhere.
cmake_minimum_required(VERSION 3.16)
file(READ "${PAGE}" page)

# The text between <element> and </element>, which must occur once.
function(text_of element result)
  string(REGEX MATCHALL "<${element}>" openings "${page}")
  list(LENGTH openings count)
  if(NOT count EQUAL 1)
    message(FATAL_ERROR "${PAGE}: ${count} times <${element}>, not once")
  endif()
  string(FIND "${page}" "<${element}>" from)
  string(FIND "${page}" "</${element}>" to)
  string(LENGTH "<${element}>" opening)
  math(EXPR from "${from} + ${opening}")
  math(EXPR length "${to} - ${from}")
  string(SUBSTRING "${page}" ${from} ${length} text)
  set(${result} "${text}" PARENT_SCOPE)
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

text_of(style style)
text_of(script script)
policy_hash("${style}" style_hash)
policy_hash("${script}" script_hash)
set(policy "default-src 'none'; style-src ${style_hash}; script-src ${script_hash}; connect-src 'self'; img-src data:; ")
string(APPEND policy "base-uri 'none'; form-action 'none'; frame-ancestors 'none'")
file(WRITE "${SOURCE}" "#include \"edge_app/output/status_page.h\"

namespace alidade {

const char* const kStatusPagePolicy = R\"page(${policy})page\";

const char* const kStatusPage = R\"page(${page})page\";

}  // namespace alidade
")
