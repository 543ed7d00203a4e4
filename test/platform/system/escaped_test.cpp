#include "platform/system/escaped.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "platform/system/shown.h"

namespace alidade {
namespace {

TEST(Escaped, WhatATerminalWouldObeyIsSeen) {
  EXPECT_EQ(escaped("\x1b[2J\x1b]0;title\a"), "\\x1b[2J\\x1b]0;title\\x07");
  EXPECT_EQ(escaped("a\r\nb\tc\x7f"), "a\\r\\nb\\tc\\x7f");
  EXPECT_EQ(escaped(std::string("a\0b", 3)), "a\\x00b");
}

TEST(Escaped, ControlsBeyondAsciiAreToo) {
  EXPECT_EQ(escaped("\xc2\x9b"
                    "31m"),
            "\\u009b31m");
  EXPECT_EQ(escaped("\xe2\x80\xa8\xe2\x80\xae"), "\\u2028\\u202e");
  // A byte of ISO 8859-1 is no UTF-8, and a terminal may obey it.
  EXPECT_EQ(escaped("\x9b"
                    "31m \xe4"),
            "\\x9b31m \\xe4");
}

TEST(Escaped, TextOfAllLanguagesStays) {
  const std::string text = "gr\u00fcn \u00b1 0.1\u00b0 \u30ab\u30e1\u30e9 \U0001F4F7 a\\b 'c'";
  EXPECT_EQ(escaped(text), text);
  EXPECT_EQ(escaped(""), "");
}

TEST(Escaped, NoUtf8IsShownByteForByte) {
  EXPECT_EQ(escaped("\xe3\x82"), "\\xe3\\x82") << "cut off";
  EXPECT_EQ(escaped(std::string_view("\xe3\x82\xab", 2)), "\\xe3\\x82") << "by a view";
  EXPECT_EQ(escaped("\xc0\x9b"), "\\xc0\\x9b") << "longer than it must be";
  EXPECT_EQ(escaped("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "half of a pair";
}

TEST(Shown, IsShortAndEscapedAndCutBetweenCharacters) {
  EXPECT_EQ(shown("a\x1b[2J", 3), "a\\x1b[");
  EXPECT_EQ(shown("gr\u00fcn", 3), "gr");
  EXPECT_EQ(shown("gr\u00fcn", 4), "gr\u00fc");
  EXPECT_EQ(shown("\U0001F4F7", 3), "");
  EXPECT_EQ(shown("\x80\x80\x80\x80\x80", 4), "\\x80\\x80\\x80\\x80") << "no UTF-8";
  EXPECT_EQ(shown("", 0), "");
  // What an error shows goes to the log, which escapes once more.
  EXPECT_EQ(escaped(shown("a\n\x9b\\")), shown("a\n\x9b\\"));
}

}  // namespace
}  // namespace alidade
