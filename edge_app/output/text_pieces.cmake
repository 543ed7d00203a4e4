# text_pieces(TEXT NAME RESULT): statements of C++ that append the text to the string `text`, in
# pieces that end with a line: a compiler need not take a literal above 65536 bytes.
# NAME: for messages.
function(text_pieces text name result)
  set(pieces "")
  while(NOT text STREQUAL "")
    string(SUBSTRING "${text}" 0 60000 piece)
    string(FIND "${piece}" "\n" end REVERSE)
    if(end EQUAL -1)
      message(FATAL_ERROR "${name}: a line is too long, or the last one has no end")
    endif()
    math(EXPR end "${end} + 1")
    string(SUBSTRING "${text}" 0 ${end} piece)
    string(SUBSTRING "${text}" ${end} -1 text)
    string(APPEND pieces "  text += R\"piece(${piece})piece\";\n")
  endwhile()
  set(${result} "${pieces}" PARENT_SCOPE)
endfunction()
