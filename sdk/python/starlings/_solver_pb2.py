"""The messages of solver.proto. Written by generate.py: change the file there, not here."""

import base64

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

_DESCRIPTION = base64.b64decode(
    "Cgxzb2x2ZXIucHJvdG8SE3N0YXJsaW5ncy5zb2x2ZXIudjEiLQoPRGVzY3JpYmVSZXF1ZXN0EhoKCHByb3RvY29sGAEgASgNUghw"
    "cm90b2NvbCLlAwoLRGVzY3JpcHRpb24SGgoIcHJvdG9jb2wYASABKA1SCHByb3RvY29sEhIKBG5hbWUYAiABKAlSBG5hbWUSEgoE"
    "c2F5cxgDIAEoCVIEc2F5cxI1CgZzdGF0ZXMYBCADKAsyHS5zdGFybGluZ3Muc29sdmVyLnYxLlF1YW50aXR5UgZzdGF0ZXMSPQoK"
    "cGFyYW1ldGVycxgFIAMoCzIdLnN0YXJsaW5ncy5zb2x2ZXIudjEuUXVhbnRpdHlSCnBhcmFtZXRlcnMSNwoHb3V0cHV0cxgGIAMo"
    "CzIdLnN0YXJsaW5ncy5zb2x2ZXIudjEuUXVhbnRpdHlSB291dHB1dHMSNQoGaW5wdXRzGAcgAygLMh0uc3RhcmxpbmdzLnNvbHZl"
    "ci52MS5RdWFudGl0eVIGaW5wdXRzEhgKB3Jlc3RhcnQYCCABKAhSB3Jlc3RhcnQSJAoNZGV0ZXJtaW5pc3RpYxgJIAEoCFINZGV0"
    "ZXJtaW5pc3RpYxIcCglvYnNlcnZlcnMYCiADKAlSCW9ic2VydmVycxIUCgVob3N0cxgLIAMoCVIFaG9zdHMSOAoIbWVhc3VyZXMY"
    "DCADKAsyHC5zdGFybGluZ3Muc29sdmVyLnYxLk1lYXN1cmVSCG1lYXN1cmVzIuIBCghRdWFudGl0eRISCgRuYW1lGAEgASgJUgRu"
    "YW1lEhIKBHVuaXQYAiABKAlSBHVuaXQSEgoEc2l6ZRgDIAEoDVIEc2l6ZRISCgRyb2xlGAQgASgJUgRyb2xlEhMKAmxvGAUgASgB"
    "SABSAmxviAEBEhMKAmhpGAYgASgBSAFSAmhpiAEBEigKDWRlZmF1bHRfdmFsdWUYByABKAFIAlIMZGVmYXVsdFZhbHVliAEBEhIK"
    "BHNheXMYCCABKAlSBHNheXNCBQoDX2xvQgUKA19oaUIQCg5fZGVmYXVsdF92YWx1ZSI3CgdNZWFzdXJlEhYKBm91dHB1dBgBIAEo"
    "CVIGb3V0cHV0EhQKBXN0YXRlGAIgASgJUgVzdGF0ZSLDBAoKUnVuUmVxdWVzdBIaCghwYXJ0aWNsZRgBIAEoDVIIcGFydGljbGUS"
    "FgoGcmVjb3JkGAIgASgNUgZyZWNvcmQSHgoKcGFyYW1ldGVycxgDIAEoDFIKcGFyYW1ldGVycxI0Cgdpbml0aWFsGAQgAygLMhou"
    "c3RhcmxpbmdzLnNvbHZlci52MS5OYW1lZFIHaW5pdGlhbBIZCgVzdGF0ZRgFIAEoDEgAUgVzdGF0ZYgBARIZCgVzdGFydBgGIAEo"
    "AUgBUgVzdGFydIgBARIUCgV0aW1lcxgHIAEoDFIFdGltZXMSGAoHb3V0cHV0cxgIIAMoCVIHb3V0cHV0cxIaCghvYnNlcnZlZBgJ"
    "IAEoDFIIb2JzZXJ2ZWQSOQoIb2JzZXJ2ZXIYCiABKAsyHS5zdGFybGluZ3Muc29sdmVyLnYxLk9ic2VydmVyUghvYnNlcnZlchIz"
    "CgZpbnB1dHMYCyADKAsyGy5zdGFybGluZ3Muc29sdmVyLnYxLlNpZ25hbFIGaW5wdXRzEi8KBXRlcm1zGAwgAygLMhkuc3Rhcmxp"
    "bmdzLnNvbHZlci52MS5UZXJtUgV0ZXJtcxI4Cgljb25zdGFudHMYDSADKAsyGi5zdGFybGluZ3Muc29sdmVyLnYxLk5hbWVkUglj"
    "b25zdGFudHMSGAoHc2NyYXRjaBgOIAEoCVIHc2NyYXRjaBIgCgt0cmFjZXBhcmVudBgPIAEoCVILdHJhY2VwYXJlbnRCCAoGX3N0"
    "YXRlQggKBl9zdGFydCJACgVOYW1lZBISCgRuYW1lGAEgASgJUgRuYW1lEhkKBXZhbHVlGAIgASgBSABSBXZhbHVliAEBQggKBl92"
    "YWx1ZSIyCghPYnNlcnZlchISCgRraW5kGAEgASgJUgRraW5kEhIKBGdhaW4YAiABKAFSBGdhaW4iNgoGU2lnbmFsEhQKBXRpbWVz"
    "GAEgASgMUgV0aW1lcxIWCgZ2YWx1ZXMYAiABKAxSBnZhbHVlcyI8CgRUZXJtEhQKBXN0YXRlGAEgASgJUgVzdGF0ZRIeCgpleHBy"
    "ZXNzaW9uGAIgASgJUgpleHByZXNzaW9uIsYBCghSdW5SZXBseRI7Cghwcm9ncmVzcxgBIAEoCzIdLnN0YXJsaW5ncy5zb2x2ZXIu"
    "djEuUHJvZ3Jlc3NIAFIIcHJvZ3Jlc3MSOwoIZmluaXNoZWQYAiABKAsyHS5zdGFybGluZ3Muc29sdmVyLnYxLkZpbmlzaGVkSABS"
    "CGZpbmlzaGVkEjgKB2ZhaWx1cmUYAyABKAsyHC5zdGFybGluZ3Muc29sdmVyLnYxLkZhaWx1cmVIAFIHZmFpbHVyZUIGCgRraW5k"
    "IiwKCFByb2dyZXNzEhcKBHRpbWUYASABKAFIAFIEdGltZYgBAUIHCgVfdGltZSI6CghGaW5pc2hlZBIYCgdvdXRwdXRzGAEgASgM"
    "UgdvdXRwdXRzEhQKBXN0YXRlGAIgASgMUgVzdGF0ZSLQAQoHRmFpbHVyZRI1CgRraW5kGAEgASgOMiEuc3RhcmxpbmdzLnNvbHZl"
    "ci52MS5GYWlsdXJlLktpbmRSBGtpbmQSEgoEdGV4dBgCIAEoCVIEdGV4dBIXCgR0aW1lGAMgASgBSABSBHRpbWWIAQEiWAoES2lu"
    "ZBIKCgZTT0xWRVIQABIOCgpOT1RfRklOSVRFEAESDwoLQkFEX1JFUVVFU1QQAhISCg5PVVRTSURFX0RPTUFJThADEg8KC1VOQVZB"
    "SUxBQkxFEARCBwoFX3RpbWUypQEKBlNvbHZlchJSCghEZXNjcmliZRIkLnN0YXJsaW5ncy5zb2x2ZXIudjEuRGVzY3JpYmVSZXF1"
    "ZXN0GiAuc3RhcmxpbmdzLnNvbHZlci52MS5EZXNjcmlwdGlvbhJHCgNSdW4SHy5zdGFybGluZ3Muc29sdmVyLnYxLlJ1blJlcXVl"
    "c3QaHS5zdGFybGluZ3Muc29sdmVyLnYxLlJ1blJlcGx5MAFiBnByb3RvMw=="
)

# A pool of its own: another copy of the same file in the process does no harm.
_POOL = descriptor_pool.DescriptorPool()
_POOL.Add(descriptor_pb2.FileDescriptorProto.FromString(_DESCRIPTION))


def _message(name):
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName("starlings.solver.v1." + name))


DescribeRequest = _message("DescribeRequest")
Description = _message("Description")
Quantity = _message("Quantity")
Measure = _message("Measure")
RunRequest = _message("RunRequest")
Named = _message("Named")
Observer = _message("Observer")
Signal = _message("Signal")
Term = _message("Term")
RunReply = _message("RunReply")
Progress = _message("Progress")
Finished = _message("Finished")
Failure = _message("Failure")
