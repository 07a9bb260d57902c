//! Wire to domain and back; errors name `message.field`.
