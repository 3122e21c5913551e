// Every kind of record comes back from its bytes, and no cut of them is taken for one.
#include <gtest/gtest.h>

#include "common/recording/mcap_records.hpp"

namespace phantom::recording {
namespace {

template <class Record>
Bytes content_of(const Record& record) {
  Bytes bytes;
  append(bytes, record);
  RecordView view;
  EXPECT_TRUE(next_record(bytes, view));
  EXPECT_EQ(view.opcode, Record::kOpcode);
  EXPECT_EQ(view.size(), bytes.size());
  return Bytes(view.content.begin(), view.content.end());
}

// `least`: bytes without which there is no record (the rest is data that may be of any length).
template <class Record>
void comes_back(const Record& record, std::size_t least = 0) {
  const Bytes content = content_of(record);
  Record again;
  ASSERT_TRUE(parse(content, again));
  EXPECT_EQ(again, record);
  for (std::size_t cut = 0; cut < (least == 0 ? content.size() : least); ++cut)
    EXPECT_FALSE(parse(ByteView(content).first(cut), again)) << cut;
  Bytes longer = content;  // a later version of the format may add fields
  longer.push_back(7);
  ASSERT_TRUE(parse(longer, again));
  EXPECT_EQ(again, record);
}

TEST(Records, HeaderAndFooterComeBack) {
  comes_back(Header{"", ""});
  comes_back(Header{"ros2", "phantom 0.1"});
  comes_back(Footer{0x1122334455667788, 99, 0xdeadbeef});
}

TEST(Records, SchemaAndChannelComeBack) {
  comes_back(Schema{7, "phantom::msg::Percept", "omgidl", {1, 2, 3}});
  comes_back(Schema{1, "", "", {}});
  comes_back(Channel{65535, 7, "percept", "cdr", {{"qos", "best effort"}, {"", "x"}, {"ü", "µ"}}});
}

TEST(Records, MessageComesBackAndDataAreTheRest) {
  const Bytes data{9, 8, 7};
  const Bytes content = content_of(Message{3, 4, 5, 6, data});
  Message again;
  ASSERT_TRUE(parse(content, again));
  EXPECT_EQ(again.channel_id, 3);
  EXPECT_EQ(again.sequence, 4u);
  EXPECT_EQ(again.log_time_ns, 5u);
  EXPECT_EQ(again.publish_time_ns, 6u);
  EXPECT_EQ(Bytes(again.data.begin(), again.data.end()), data);
  for (std::size_t cut = 0; cut < 22; ++cut) EXPECT_FALSE(parse(ByteView(content).first(cut), again)) << cut;
}

TEST(Records, ChunkComesBack) {
  const Bytes records{1, 2, 3, 4};
  const Bytes content = content_of(Chunk{10, 20, 400, 0x01020304, "zstd", records});
  Chunk again;
  ASSERT_TRUE(parse(content, again));
  EXPECT_EQ(again.message_start_time_ns, 10u);
  EXPECT_EQ(again.message_end_time_ns, 20u);
  EXPECT_EQ(again.uncompressed_size, 400u);
  EXPECT_EQ(again.uncompressed_crc, 0x01020304u);
  EXPECT_EQ(again.compression, "zstd");
  EXPECT_EQ(Bytes(again.records.begin(), again.records.end()), records);
  for (std::size_t cut = 0; cut < content.size(); ++cut)
    EXPECT_FALSE(parse(ByteView(content).first(cut), again)) << cut;
}

TEST(Records, IndexesComeBack) {
  comes_back(MessageIndex{2, {{1, 2}, {3, 4}}});
  comes_back(MessageIndex{2, {}});
  comes_back(ChunkIndex{1, 2, 3, 4, {{5, 6}, {7, 8}}, 9, "zstd", 10, 11});
  comes_back(AttachmentIndex{1, 2, 3, 4, 5, "cell.yaml", "application/yaml"});
  comes_back(MetadataIndex{1, 2, "losses"});
  comes_back(SummaryOffset{Opcode::kChunkIndex, 3, 4});
}

TEST(Records, AttachmentMetadataStatisticsAndDataEndComeBack) {
  comes_back(Attachment{1, 2, "cell.yaml", "application/yaml", {1, 2, 3}});
  comes_back(Metadata{"losses", {{"slave_state", "3"}}});
  comes_back(Metadata{"", {}});
  comes_back(Statistics{1, 2, 3, 4, 5, 6, 7, 8, {{1, 2}, {3, 4}}});
  comes_back(DataEnd{0x12345678});
}

TEST(Records, ADamagedAttachmentIsRefused) {
  Bytes content = content_of(Attachment{1, 2, "cell.yaml", "application/yaml", {1, 2, 3}});
  Attachment again;
  for (std::size_t i = 0; i + 4 < content.size(); ++i) {
    content[i] ^= 0x10;
    EXPECT_FALSE(parse(content, again)) << i;
    content[i] ^= 0x10;
  }
}

TEST(Records, TheBytesAreThoseOfTheSpecification) {
  Bytes bytes;
  append(bytes, Channel{0x0102, 3, "ab", "c", {{"k", "v"}}});
  EXPECT_EQ(bytes, (Bytes{0x04, 29,   0, 0, 0,   0,   0, 0, 0,            // opcode, length
                          0x02, 0x01, 3, 0,                               // id, schema_id
                          2,    0,    0, 0, 'a', 'b', 1, 0, 0,   0, 'c',  // topic, message_encoding
                          10,   0,    0, 0, 1,   0,   0, 0, 'k', 1, 0,   0, 0, 'v'}))  // metadata
      << "little-endian, lengths before strings and maps";
}

TEST(Records, TheChecksumIsThatOfIeee8023) {
  const std::string text = "123456789";
  const Bytes bytes(text.begin(), text.end());
  EXPECT_EQ(crc32(bytes), 0xCBF43926u) << "the check value of the standard";
  EXPECT_EQ(crc32(ByteView(bytes).subspan(4), crc32(ByteView(bytes).first(4))), 0xCBF43926u);
}

}  // namespace
}  // namespace phantom::recording
